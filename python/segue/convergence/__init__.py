"""Error against run time: methods rendered side by side, references whose own error is known.

`methods` names what is compared, `running` renders in turns and measures, `reference` makes the
picture that is measured against, `peers` asks other renderers; `tables`, `plots`, `pictures` and
`page` write the report.
"""
