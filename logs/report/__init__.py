"""A run as one page: gathered from its log in one pass, drawn by a script that the page holds.

The curves, the map and the diagrams are drawn by a script of our own, and not by plotly: all of
them share one time axis with one zoom and one cursor, a page is a tenth of plotly's own 4.8 MB, and
it needs no WebGL, and nothing but Farside itself.
"""

from farside.logs.report.page import report_page

__all__ = ["report_page"]
