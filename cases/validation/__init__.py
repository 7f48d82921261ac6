"""Validation: every case measures a run against an exact answer or an experiment."""
