"""Options, each said once: a field of a group, with type, default, unit, range and one sentence.

A group is a frozen record, which is passed on as it is. From it come the keywords of functions
(`keywords_of`), which editors complete and mypy checks, the tables of job files (`table_of`), the flags of
commands and the tables of the documentation.
"""
