"""User interface of the window: side panel, status text, scene browser, help, timeline, plots."""
