"""What `import blysk` gives: scenes, designs, frames and Verilog, with a default for every option."""
