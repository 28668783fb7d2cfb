"""The dashboard under the load of a plant, as a browser meets it."""
