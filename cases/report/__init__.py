"""Reports: one self-contained HTML page a run, and the page and chart builders that other reports share."""
