"""Many files: pieces of work, a pool or a cluster that carries them out, what is done already, and the table."""
