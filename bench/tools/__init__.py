"""Tools for a designer: unit table and pages, design space, place and route, the live page."""
