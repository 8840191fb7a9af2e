"""Where pieces of work are done: in this process, in others, or on the workers of a Dask cluster.

Threads that schedule (Prefect's, or a command's own) give each piece to executors, and wait for its result.
Executors know nothing of Prefect: their workers need neither Prefect's server nor its settings.
"""
