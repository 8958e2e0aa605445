def rows_of_faults(setup):
    raise NotImplementedError
