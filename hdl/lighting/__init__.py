"""Units that turn cosines into light."""
