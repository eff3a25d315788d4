"""The report: tables, figures and one self-contained HTML page from a store of results; nothing is run here."""
