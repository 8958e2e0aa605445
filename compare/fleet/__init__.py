"""A fleet: many files, compared one by one by processes or a cluster, and listed in one table."""
