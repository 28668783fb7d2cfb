"""The node that identifies a valve and watches its friction."""
