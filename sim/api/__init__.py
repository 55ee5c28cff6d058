"""Interface of `import blysk`: scenes, designs, frames and Verilog, with a default for every option."""
