"""A fleet: many model files, compared one by one by a pool of processes or a cluster, and listed in one table."""
