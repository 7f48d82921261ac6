"""Cases of the source documents with bodies."""
