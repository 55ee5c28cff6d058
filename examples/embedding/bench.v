// Runs triangle.v until it is done, and writes the picture. Each line has a pixel: rrggbb.
module bench;
  reg clk = 0, rst = 1;
  wire done;
  integer k;
  triangle triangle (.clk(clk), .rst(rst), .done(done));
  always #1 clk = !clk;
  initial begin
    repeat (2) @(posedge clk);
    #0 rst = 0;
    for (k = 0; k < 20000 && !done; k = k + 1) @(posedge clk);
    $writememh("picture.hex", triangle.picture, 0, 24 * 32 - 1);
    $finish;
  end
endmodule
