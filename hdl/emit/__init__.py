"""From a component to Verilog, and to the count of its parts."""
