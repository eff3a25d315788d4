"""What lies on disk: recordings, stores of results, evidence for the report, records of trials."""
