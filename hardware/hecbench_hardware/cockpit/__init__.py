"""Record and calibrate a cell in the browser: `session` does the work, `page` shows it."""
