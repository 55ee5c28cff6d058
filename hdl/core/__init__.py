"""What every unit is built of: fixed-point shapes, streams, scheduled datapaths."""
