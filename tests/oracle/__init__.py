"""A ray caster that shares no code with the project, and frames of the pipeline that are compared with it."""
