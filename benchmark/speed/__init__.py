"""What identification costs, each item beside its peers: `make bench`."""
