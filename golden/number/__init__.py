"""Numbers: fixed-point formats and arrays, unit vectors as codes, polynomial fits."""
