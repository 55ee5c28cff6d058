// Draws a triangle into a memory of 32 x 24 pixels. The header of the core describes its ports and codes. Make the core by
//   blysk verilog --top render --model cosquad -o core.v
module triangle (input clk, input rst, output done);
  reg [23:0] picture [0:1023], depths [0:1023], depth;
  reg [4:0] n;   // number of frame constants written, 0 to 16; 17 after the triangle
  integer k;
  initial for (k = 0; k < 1024; k = k + 1) picture[k] = 24'h1a1c20;   // the core clears the memory of depths

  // Ambient 0.05, diffuse 0.4, specular 0.55, exponent 50, white light along the viewer.
  wire [8:0] address = n < 4 ? n : n + 12;
  wire [17:0] data = n == 0 ? 50 : n < 4 ? 816 : n == 6 || n == 9 ? 131071 : n < 10 ? 0 : n < 13 ? 6528 : 8976;
  wire write_ready, i_ready, o_valid, read;
  always @(posedge clk)
    if (rst) n <= 0;
    else if (n < 16 ? write_ready : n == 16 && i_ready) n <= n + 1;

  wire [11:0] x, y, rx, ry, wx, wy;
  wire [7:0] r, g, b;
  wire [23:0] o_depth, new_depth;
  wire write;
  reg [10:0] quiet;   // clocks since the last pixel; after 2047 clocks no pixel of the triangle comes any more
  assign done = &quiet;
  always @(posedge clk) begin
    if (o_valid) picture[{y[4:0], x[4:0]}] <= {r, g, b};
    if (read) depth <= depths[{ry[4:0], rx[4:0]}];
    if (write) depths[{wy[4:0], wx[4:0]}] <= new_depth;
    quiet <= rst || o_valid || n < 17 ? 0 : done ? quiet : quiet + 1;
  end

  // Corners are in 1/256 pixel, counted from the middle of the picture; normals are times 2^23. The limit is
  // 2048 sin(10 degrees / 2): the core's header names 10 degrees for exponent 50.
  blysk core (.clk(clk), .rst(rst),
    .write_address(address), .write_data(data), .write_valid(n < 16), .write_ready(write_ready),
    .i_valid(n == 16), .i_ready(i_ready), .i_material(10'd0), .i_two_sided(1'd0),
    .i_x_0(-20'sd3584), .i_x_1(-20'sd1024), .i_x_2(20'sd3328), .i_y_0(-20'sd2560), .i_y_1(20'sd2816), .i_y_2(-20'sd512),
    .i_depth_0(24'd1000), .i_depth_1(24'd3000), .i_depth_2(24'd2000),
    .i_normal_0_0(-24'sd5033165), .i_normal_0_1(24'sd2516582), .i_normal_0_2(24'sd6174015),
    .i_normal_1_0(-24'sd838861), .i_normal_1_1(-24'sd5033165), .i_normal_1_2(24'sd6658042),
    .i_normal_2_0(24'sd5872026), .i_normal_2_1(24'sd1677722), .i_normal_2_2(24'sd5751001),
    .constants_left(-13'sd16), .constants_top(-13'sd12), .constants_right(13'sd16), .constants_bottom(13'sd12),
    .constants_back_faces(2'd0), .constants_limit(10'd178), .constants_picture(1'b0),
    .o_valid(o_valid), .o_ready(1'b1), .o_x(x), .o_y(y), .o_r(r), .o_g(g), .o_b(b), .o_depth(o_depth),
    .memory_read_enable(read), .memory_read_place_x(rx), .memory_read_place_y(ry), .memory_read_data(depth),
    .memory_write_enable(write), .memory_write_place_x(wx), .memory_write_place_y(wy), .memory_write_data(new_depth));
endmodule
