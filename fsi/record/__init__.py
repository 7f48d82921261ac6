"""What a run leaves behind: log, timeline, run folder, and their readers."""
