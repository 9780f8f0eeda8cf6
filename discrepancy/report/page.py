"""report.html"""


def page(outcome, whole):
    return "<html></html>"
