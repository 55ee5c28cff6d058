// Three clocks in, four lanes out: the display's Verilog and the model of four output cells.
module bench(input clk, input pixel_clk, input serial_clk, output [2:0] tmds_data_p, output tmds_clk_p);
  wire [7:0] pairs;
  reg [3:0] lanes = 0, second = 0;
  dvi_top top(.clk(clk), .rst(1'b0), .pixel_clk(pixel_clk), .pixel_rst(1'b0), .serial_clk(serial_clk),
    .serial_rst(1'b0), .pairs(pairs), .status());
  always @(posedge serial_clk) begin
    lanes <= {pairs[6], pairs[4], pairs[2], pairs[0]};
    second <= {pairs[7], pairs[5], pairs[3], pairs[1]};
  end
  always @(negedge serial_clk) lanes <= second;
  assign {tmds_clk_p, tmds_data_p} = lanes;
endmodule
