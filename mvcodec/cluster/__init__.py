"""Work on many machines, by Dask: recordings in segments, studies point by point."""
