"""report.html of a run: set-up, table, run-time split, curves and pictures in one file."""
