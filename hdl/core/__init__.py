"""Parts of every unit: fixed-point shapes, streams, scheduled datapaths."""
