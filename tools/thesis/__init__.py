"""The thesis's tables, measured anew on the same or the nearest pictures that are at hand."""
