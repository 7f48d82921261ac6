"""Runs the validation cases and keeps their rows, plots and pages."""
