// Models of the ECP5 cells that Yosys's library has as black boxes; written from Lattice's sysDSP and memory
// usage guides, TN1267 and TN1264, for the modes that this project's netlists use. Another mode does not compile.

// A multiplier of 18x18 bits with a register for either operand and one for the product.
module MULT18X18D (
  input A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0,
  input B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0,
  input C17, C16, C15, C14, C13, C12, C11, C10, C9, C8, C7, C6, C5, C4, C3, C2, C1, C0,
  input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB,
  input CLK3, CLK2, CLK1, CLK0, CE3, CE2, CE1, CE0, RST3, RST2, RST1, RST0,
  output P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18,
  output P17, P16, P15, P14, P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0
);
  parameter REG_INPUTA_CLK = "NONE";
  parameter REG_INPUTA_CE = "CE0";
  parameter REG_INPUTA_RST = "RST0";
  parameter REG_INPUTB_CLK = "NONE";
  parameter REG_INPUTB_CE = "CE0";
  parameter REG_INPUTB_RST = "RST0";
  parameter REG_OUTPUT_CLK = "NONE";
  parameter REG_OUTPUT_CE = "CE0";
  parameter REG_OUTPUT_RST = "RST0";
  parameter REG_PIPELINE_CLK = "NONE";
  parameter GSR = "ENABLED";
  parameter RESETMODE = "SYNC";

  wire [17:0] a = {A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0};
  wire [17:0] b = {B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0};
  wire [17:0] a_used, b_used;
  wire [35:0] wide_a = {{18{SIGNEDA & a_used[17]}}, a_used};
  wire [35:0] wide_b = {{18{SIGNEDB & b_used[17]}}, b_used};
  wire [35:0] p;

  generate
    if (REG_PIPELINE_CLK != "NONE" || RESETMODE != "SYNC") a_mode_without_a_model stop ();
  endgenerate

  ecp5_register #(.WIDTH(18), .CLK(REG_INPUTA_CLK), .CE(REG_INPUTA_CE), .RST(REG_INPUTA_RST)) register_a (
    .clk({CLK3, CLK2, CLK1, CLK0}), .ce({CE3, CE2, CE1, CE0}), .rst({RST3, RST2, RST1, RST0}), .d(a), .q(a_used));
  ecp5_register #(.WIDTH(18), .CLK(REG_INPUTB_CLK), .CE(REG_INPUTB_CE), .RST(REG_INPUTB_RST)) register_b (
    .clk({CLK3, CLK2, CLK1, CLK0}), .ce({CE3, CE2, CE1, CE0}), .rst({RST3, RST2, RST1, RST0}), .d(b), .q(b_used));
  ecp5_register #(.WIDTH(36), .CLK(REG_OUTPUT_CLK), .CE(REG_OUTPUT_CE), .RST(REG_OUTPUT_RST)) register_p (
    .clk({CLK3, CLK2, CLK1, CLK0}), .ce({CE3, CE2, CE1, CE0}), .rst({RST3, RST2, RST1, RST0}),
    .d(wide_a * wide_b), .q(p));

  assign {P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18,
          P17, P16, P15, P14, P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0} = p;
endmodule

// A register of a multiplier, with one of four clocks, enables and resets; or wires.
module ecp5_register (input [3:0] clk, input [3:0] ce, input [3:0] rst, input [WIDTH-1:0] d, output [WIDTH-1:0] q);
  parameter WIDTH = 1;
  parameter CLK = "NONE";
  parameter CE = "CE0";
  parameter RST = "RST0";
  wire enable = CE == "CE0" ? ce[0] : CE == "CE1" ? ce[1] : CE == "CE2" ? ce[2] : ce[3];
  wire reset = RST == "RST0" ? rst[0] : RST == "RST1" ? rst[1] : RST == "RST2" ? rst[2] : rst[3];
  generate
    if (CLK == "NONE") begin : wires
      assign q = d;
    end else if (CLK == "CLK0") begin : register
      reg [WIDTH-1:0] held = 0;
      always @(posedge clk[0]) if (reset) held <= 0; else if (enable) held <= d;
      assign q = held;
    end else a_mode_without_a_model stop ();
  endgenerate
endmodule

// A memory of 1024 words of 18 bits: two ports of 9 or 18 bits, or a write port and a read port of 36 bits.
module DP16KD (
  input DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9,
  input DIA8, DIA7, DIA6, DIA5, DIA4, DIA3, DIA2, DIA1, DIA0,
  input ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5, ADA4, ADA3, ADA2, ADA1, ADA0,
  input CEA, OCEA, CLKA, WEA, RSTA, CSA2, CSA1, CSA0,
  output DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9,
  output DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1, DOA0,
  input DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9,
  input DIB8, DIB7, DIB6, DIB5, DIB4, DIB3, DIB2, DIB1, DIB0,
  input ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5, ADB4, ADB3, ADB2, ADB1, ADB0,
  input CEB, OCEB, CLKB, WEB, RSTB, CSB2, CSB1, CSB0,
  output DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9,
  output DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1, DOB0
);
  parameter DATA_WIDTH_A = 18;
  parameter DATA_WIDTH_B = 18;
  parameter REGMODE_A = "NOREG";
  parameter REGMODE_B = "NOREG";
  parameter RESETMODE = "SYNC";
  parameter ASYNC_RESET_RELEASE = "SYNC";
  parameter CSDECODE_A = "0b000";
  parameter CSDECODE_B = "0b000";
  parameter WRITEMODE_A = "NORMAL";
  parameter WRITEMODE_B = "NORMAL";
  parameter CLKAMUX = "CLKA";
  parameter CLKBMUX = "CLKB";
  parameter GSR = "ENABLED";
@INITVALS@
  // Of each 20 bits of an initial value, 18 count.
  localparam [20479:0] INITIAL = {@INITIAL@};

  wire [13:0] ada = {ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5, ADA4, ADA3, ADA2, ADA1, ADA0};
  wire [13:0] adb = {ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5, ADB4, ADB3, ADB2, ADB1, ADB0};
  wire [17:0] dia = {DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9,
                     DIA8, DIA7, DIA6, DIA5, DIA4, DIA3, DIA2, DIA1, DIA0};
  wire [17:0] dib = {DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9,
                     DIB8, DIB7, DIB6, DIB5, DIB4, DIB3, DIB2, DIB1, DIB0};
  reg [17:0] doa = 0, dob = 0;
  wire [17:0] qa, qb;
  reg [17:0] words [0:1023];
  integer k;
  initial for (k = 0; k < 1024; k = k + 1) words[k] = INITIAL[20 * k +: 18];

  generate
    if (DATA_WIDTH_A == 36 && DATA_WIDTH_B == 36) begin : simple
      always @(posedge CLKA)
        if (CEA && WEA) begin
          if (ada[0]) words[{ada[13:5], 1'b0}][8:0] <= dia[8:0];
          if (ada[1]) words[{ada[13:5], 1'b0}][17:9] <= dia[17:9];
          if (ada[2]) words[{ada[13:5], 1'b1}][8:0] <= dib[8:0];
          if (ada[3]) words[{ada[13:5], 1'b1}][17:9] <= dib[17:9];
        end
      always @(posedge CLKB)
        if (CEB) {dob, doa} <= {words[{adb[13:5], 1'b1}], words[{adb[13:5], 1'b0}]};
    end else if (DATA_WIDTH_A == 36 || DATA_WIDTH_B == 36) a_mode_without_a_model stop ();
    else begin : double
      ecp5_no_writes #(.WIDTH(DATA_WIDTH_A)) port_a (.clk(CLKA), .writes(CEA & WEA));
      ecp5_no_writes #(.WIDTH(DATA_WIDTH_B)) port_b (.clk(CLKB), .writes(CEB & WEB));
      always @(posedge CLKA)
        if (CEA) doa <= DATA_WIDTH_A == 18 ? words[ada[13:4]] : words[ada[13:4]][9 * ada[3] +: 9];
      always @(posedge CLKB)
        if (CEB) dob <= DATA_WIDTH_B == 18 ? words[adb[13:4]] : words[adb[13:4]][9 * adb[3] +: 9];
    end
  endgenerate

  assign {DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9,
          DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1, DOA0} = qa;
  assign {DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9,
          DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1, DOB0} = qb;

  // A port of 36 bits is read by the clock and the enable of B.
  localparam WIDE = DATA_WIDTH_B == 36;
  ecp5_word #(.REGMODE(REGMODE_A)) word_a (.clk(WIDE ? CLKB : CLKA), .ce(OCEA), .rst(RSTA), .d(doa), .q(qa));
  ecp5_word #(.REGMODE(REGMODE_B)) word_b (.clk(CLKB), .ce(OCEB), .rst(RSTB), .d(dob), .q(qb));
endmodule

// The register behind a memory's word, or wires.
module ecp5_word (input clk, input ce, input rst, input [17:0] d, output [17:0] q);
  parameter REGMODE = "NOREG";
  generate
    if (REGMODE == "NOREG") begin : wires
      assign q = d;
    end else if (REGMODE == "OUTREG") begin : register
      reg [17:0] held = 0;
      always @(posedge clk) if (rst) held <= 0; else if (ce) held <= d;
      assign q = held;
    end else a_mode_without_a_model stop ();
  endgenerate
endmodule

// A port of a table: of 9 or 18 bits, and never written.
module ecp5_no_writes (input clk, input writes);
  parameter WIDTH = 18;
  generate
    if (WIDTH != 9 && WIDTH != 18) a_mode_without_a_model stop ();
  endgenerate
  always @(posedge clk)
    if (writes) begin
      $display("a table is written");
      $finish;
    end
endmodule
