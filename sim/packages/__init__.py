"""Packages of a core for the tools of others: FuseSoC, SystemRDL, IP-XACT, Vivado, LiteX."""
