"""Several objects among other things: how they are placed, drawn, observed and shown."""
