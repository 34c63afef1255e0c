"""From a site to certified paths: the pipeline, and what it checks."""
