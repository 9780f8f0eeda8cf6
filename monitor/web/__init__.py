"""The page and its interface.

access   who asks, and what he may
hub      what changed -> every open page
api      the interface: fleet, trends, turns, alarms
views    what the store holds -> what a view shows
app      all of it behind the headers of a careful server
static/  the page: HTML, style, script, texts; uPlot draws (MIT licence, beside it)
"""
