"""Validation of the coupling between fluid and bodies; `fsi validate coupling` runs all of it."""
