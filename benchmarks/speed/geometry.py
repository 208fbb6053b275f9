def charts(quick):
    return ()
