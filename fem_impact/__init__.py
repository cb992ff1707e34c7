"""Strike anything thin with anything, and know how far to trust the answer."""
