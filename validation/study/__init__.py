"""Error against run time: every level × element order × method of the cases, and the methods on recorded problems.

`plan` says what is to be run, `worker` runs it in processes of their own, `pool` shares the work among them, `journal`
keeps what has finished, and `tables` makes of that the tables of a study, with the rates and the cheapest ways of
`rates`.
"""
