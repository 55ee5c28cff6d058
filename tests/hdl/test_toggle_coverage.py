"""Toggle coverage: under the tests' vectors every bit of every device's registers rises and falls."""

import re
import sys

import numpy as np
import pytest
from amaranth.hdl import Fragment, Signal
from amaranth.lib import data
from amaranth.lib.wiring import Out

from blysk.bench.quality.mutants import DEVICES, Wrapped, vectors_of
from blysk.sim.engines.cxxrtl import Model
from blysk.sim.engines.toggles import _registers, _words

# Bits that cannot toggle, by device and reason: registers with their bits. The list is exact.
SQUARE = "the second bit of a square is 0"
QUADRATIC = {
    "the polynomial's products are at most 0.0127 and 0.0293": (
        "interpolator.middle_normal.datapath.rounded_2[13-16] "
        "interpolator.middle_normal.datapath.rounded_1[14-16]"
    ),
    "its inner sums are 0.0458 to 0.0586 and 0.1250 to 0.1544": (
        "interpolator.middle_normal.datapath.total_{1,2}[14-16]"
    ),
    "twice a number is even": (
        "interpolator.{spare,payload,difference_setup.spare}[186] "
        "interpolator.{spare,payload,difference_setup.spare}[230] "
        "interpolator.{spare,payload,difference_setup.spare}[274] "
        "interpolator.difference_setup.datapath.second_{0-2}[0] "
        "interpolator.difference_accumulator.normal_{0-2}_second_difference[0]"
    ),
    "a reciprocal is normalised, and so is its square, so that the first bit is 1": (
        "interpolator.difference_setup.datapath.reciprocal{,s.port__data}[16] "
        "interpolator.difference_setup.datapath.square{,_rounded}[16] "
        "interpolator.difference_setup.datapath.multiplier_{0,1}_{a_0,a_1,0}[16]"
    ),
    "the largest square in the table is under 1 by 62 steps": (
        "interpolator.difference_setup.datapath.square_rounded[17]"
    ),
    "a length of 12 bits takes shifts up to 12, and its square up to 25": (
        "interpolator.difference_setup.datapath.shift{,_9}[4] "
        "interpolator.difference_setup.datapath.square_shift[5]"
    ),
}
STILL = {
    "adaptive_normaliser": {
        "half of 32 segments is the most that ends are apart or written last": (
            "top.half[5] top.write_place[5]"
        ),
        "a reciprocal is normalised and not negative, so that its first bits are 01": (
            "top.reciprocal[16-17] reciprocals.table_port__data[16]"
        ),
        "a segment has at most 4095 pixels, and they take 4094 steps and 31": (
            "top.available[13] top.$signal[12-23]"
        ),
        "a fraction is not negative": "top.phi[17]",
        "the bisection's results are taken at once": "bisection.held[0]",
        "the first sum of its polynomials is 0.056, or 0.136 to 0.303": "bisection.datapath.total_2[17]",
    },
    "angular_interpolator": {
        "of unit normals the sum of squared lengths is less than 4, product and squared distance than 2": (
            "interpolator.setup_{direction,halfway}_0.datapath.own[36-38] "
            "interpolator.setup_{direction,halfway}_0.datapath.cross[35-38] "
            "interpolator.setup_{direction,halfway}_0.datapath.chord_wide[35-40] "
            "interpolator.setup_{direction,halfway}_0.datapath.chord[35] "
            "interpolator.setup_{direction,halfway}_0.datapath.z_rounded[18]"
        ),
        "half the reciprocal of the sine, normalised, is not negative": (
            "interpolator.setup_{direction,halfway}_0.datapath.inverse_roots_sum[22] "
            "interpolator.setup_{direction,halfway}_0.datapath.inverse_roots_rounded[18]"
        ),
        "the correction is at most 0.4143": (
            "interpolator.setup_{direction,halfway}_0.datapath.corrections_sum[21] "
            "interpolator.setup_{direction,halfway}_0.datapath.corrections_rounded[17-18]"
        ),
        "from 0 to 90 degrees the factor is 0.636 to 0.708": (
            "interpolator.setup_{direction,halfway}_0.datapath.total[14-18] "
            "interpolator.setup_{direction,halfway}_0.datapath.factor[14-16]"
        ),
        "inner sums of its polynomial are smaller still": (
            "interpolator.setup_{direction,halfway}_0.datapath.total_3[15-16] "
            "interpolator.setup_{direction,halfway}_0.datapath.total_2[16]"
        ),
        "a root is 1 at most, and that only by rounding": (
            "interpolator.setup_{direction,halfway}_0.datapath.root_sum[21] "
            "interpolator.setup_{direction,halfway}_0.datapath.root_rounded[18]"
        ),
        "an axis is less than 2, and CORDIC makes the distance less than 4": (
            "interpolator.setup_{direction,halfway}_0.datapath.along[27-29] "
            "interpolator.setup_{direction,halfway}_0.datapath.along_{0-21}[28-29]"
        ),
        "cos beta is 1.42 at most, so are its partial sums, and what is shifted by 16 is small": (
            "interpolator.setup_{direction,halfway}_0.datapath.gain_1_sum{,_sum,_sum_sum}[31-33] "
            "interpolator.setup_{direction,halfway}_0.datapath.gain_1_sum_sum_sum_sum[31-33] "
            "interpolator.setup_{direction,halfway}_0.datapath.gain_16_sum[16-33] "
            "interpolator.setup_{direction,halfway}_0.datapath.cos_beta_rounded[26-29] "
            "interpolator.cosine_{direction,halfway}_0.wave.factor_6[17] "
            "interpolator.cosine_{direction,halfway}_0.wave.term_10[26]"
        ),
        "the shifted words end in zeros": "interpolator.setup_{direction,halfway}_0.datapath.gain_1_sum[0]",
        "whichever way the steps of CORDIC turn, their sum ends in the same bits": (
            "interpolator.setup_{direction,halfway}_0.datapath.direction[0-26] "
            "interpolator.setup_{direction,halfway}_0.datapath.direction_0[0-25] "
            "interpolator.setup_{direction,halfway}_0.datapath.direction_{1,2}[1] "
            "interpolator.setup_{direction,halfway}_0.datapath.direction_{1-21}[0]"
        ),
        "half an angle of 36 bits has 37": (
            "interpolator.setup_{direction,halfway}_0.datapath.phase{,_62,_66}[0-2] "
            "interpolator.setup_{direction,halfway}_0.spare[36-38] interpolator.{spare,payload}[0-2]"
        ),
        "an angle is half a turn at most, and a step is less": (
            "interpolator.setup_{direction,halfway}_0.datapath.psi_rounded[18] "
            "interpolator.setup_{direction,halfway}_0.datapath.step[39] "
            "interpolator.setup_{direction,halfway}_0.spare[115] interpolator.{spare,payload}[79] "
            "interpolator.cosine_{direction,halfway}_0.step[39]"
        ),
        "a reciprocal is normalised, so that its first bit is 1": (
            "interpolator.setup_{direction,halfway}_0.datapath.reciprocal{,s.port__data}[16]"
        ),
        "a length of 12 bits takes shifts up to 12": (
            "interpolator.setup_{direction,halfway}_0.datapath.shift[4]"
        ),
        "the table's last value with all of its rise is a step less than 1": (
            "interpolator.cosine_{direction,halfway}_0.wave.v_6[22]"
        ),
    },
    "angular_setup": {
        SQUARE: "datapath.dot_1_{0,1}_7[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "datapath.dot_1_{0,1}_7[35] datapath.dot_0_total_9[36-37]"
        ),
        "two such sums, and the squared distance from them, are less than 2^37, the cross product 2^36": (
            "datapath.own[37-38] datapath.chord_wide[37-40] datapath.cross[36-38]"
        ),
        "half the reciprocal of the sine, normalised, is not negative": (
            "datapath.inverse_roots_sum[22] datapath.inverse_roots_rounded[18]"
        ),
        "the correction is at most 0.4143": (
            "datapath.corrections_sum[21] datapath.corrections_rounded[17-18]"
        ),
        "from 0 to 90 degrees the factor is 0.636 to 0.708": "datapath.total[14-18] datapath.factor[14-16]",
        "inner sums of its polynomial are smaller still": "datapath.total_3[15-16] datapath.total_2[16]",
        "a root is 1 at most, and that only by rounding": "datapath.root_sum[21] datapath.root_rounded[18]",
        "an axis is less than 2, and CORDIC makes the distance less than 4": (
            "datapath.along[27-29] datapath.along_{0-21}[28-29]"
        ),
        "the distance and its parts are less than 4, those shifted by 16 than 2^-14, and none is negative": (
            "datapath.gain_1_sum{,_sum,_sum_sum,_sum_sum_sum}[32-33] datapath.gain_16_sum[16-33] "
            "datapath.cos_beta_rounded[27-29]"
        ),
        "the shifted words end in zeros": "datapath.gain_1_sum[0]",
        "whichever way the steps of CORDIC turn, their sum ends in the same bits": (
            "datapath.direction[0-26] datapath.direction_0[0-25] datapath.direction_{1,2}[1] "
            "datapath.direction_{1-21}[0]"
        ),
        "half an angle of 36 bits has 37": "datapath.phase[0-2] top.spare[36-38]",
        "an angle is half a turn at most, and a step is less": (
            "datapath.psi_rounded[18] datapath.step[39] top.spare[115]"
        ),
        "a reciprocal is normalised, so that its first bit is 1": (
            "datapath.reciprocals.port__data[16] datapath.reciprocal[16]"
        ),
        "a length of 12 bits takes shifts up to 12": "datapath.shift[4]",
    },
    "arccos": {
        "the numbers of five segments are 0 to 4": "datapath.segment_{3-8}[3-4]",
        "the table's words of one power all have the same bit there": (
            "datapath.c0_{4-9}[18] datapath.c1_{4-6}[1] datapath.c1_{4-6}[16] datapath.c2_4[0] "
            "datapath.c2_4[13-14] datapath.c2_4[17]"
        ),
        "the arccosine of a magnitude is 0 to 1.6": "datapath.total_{10,11}[33-42]",
        "an angle is 0 to 3.15": "datapath.turned[34-42] datapath.rounded[18-27]",
    },
    "bisection": {
        "an inner sum of either polynomial is 0.05 to 0.31": "datapath.total_2[17]",
    },
    "bisection_chain": {
        "weights are not negative": "top.weight_{l,m}[21]",
        "a pair comes on every clock, and is taken": "dot_product.ages[0-2] dot_product.held[0]",
    },
    "bisection_interpolator": {
        "half of 128 segments is the most that ends are apart or written last": (
            "interpolator.adaptive_normaliser.{half,write_place}[7]"
        ),
        "a pipeline has 23 spans inside at most": "interpolator.adaptive_normaliser.ready_spans[5-8]",
        "a reciprocal is normalised and not negative, so that its first bits are 01": (
            "interpolator.adaptive_normaliser.reciprocal[16-17] "
            "interpolator.adaptive_normaliser.reciprocals.table_port__data[16]"
        ),
        "a segment has at most 4095 pixels, and they take 4094 steps and 127": (
            "interpolator.adaptive_normaliser.available[13] interpolator.adaptive_normaliser.$signal[12-23]"
        ),
        "a fraction is not negative": "interpolator.adaptive_normaliser.phi[17]",
        "the bisection's results are taken at once": "interpolator.adaptive_normaliser.bisection.held[0]",
        "the first sum of its polynomials is 0.056, or 0.136 to 0.303": (
            "interpolator.adaptive_normaliser.bisection.datapath.total_2[17]"
        ),
    },
    "chord": {
        SQUARE: "datapath.multiplier_{0,1,2}_product{_0,}[1] datapath.u_square_2_8[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "datapath.multiplier_{0,1,2}_product{_0,}[35] datapath.u_square_2_8[35] "
            "datapath.u_square_partial[36] datapath.u_square_total[36-37] datapath.u_aligned[38-39]"
        ),
    },
    "chord_interpolator": {
        SQUARE: (
            "interpolator.chord_setup.datapath.{span,u_0_left}_square_2_9[1] "
            "interpolator.chord_setup.datapath.u_0_right_square_{0_9,2_10}[1]"
        ),
        "differences of unit components, halved if over 1, are less than 1, and so are their squares": (
            "interpolator.chord_setup.datapath.{span,u_0_left}_square_2_9[34-35] "
            "interpolator.chord_setup.datapath.u_0_right_square_{0_9,2_10}[34-35] "
            "interpolator.chord_setup.datapath.{span,u_0_left,u_0_right}_square_partial[35-36] "
            "interpolator.chord_setup.datapath.{span,u_0_left,u_0_right}_square_total[36-37]"
        ),
        "the squared distance of unit vectors is less than 4": (
            "interpolator.chord_setup.datapath.{span,u_0_left,u_0_right}_aligned[36-39] "
            "interpolator.chord_setup.datapath.{span,u_0_left,u_0_right}[36] "
            "interpolator.chord_setup.datapath.u_0_left_{16,20,24,28,32,36,40,44,48,52}[36] "
            "interpolator.chord_setup.datapath.u_0_sum[37] "
            "interpolator.chord_setup.datapath.w_rounded[21-22] "
            "interpolator.{spare,payload,chord_setup.spare}[166]"
        ),
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "interpolator.chord_setup.datapath.reciprocals.port__data[16] "
            "interpolator.chord_setup.datapath.reciprocal{,_10,_14,_18,_22,_26,_30,_34,_38,_42}[16] "
            "interpolator.chord_setup.datapath.square{,_rounded,_17,_21,_25,_29,_33,_37,_41}[16]"
        ),
        "no square of the table rounds to 1": "interpolator.chord_setup.datapath.square_rounded[17]",
        "a length of 12 bits takes shifts up to 12, and of a square up to 25": (
            "interpolator.chord_setup.datapath.shift{,_9,_13,_17,_21,_25,_29,_33,_37,_41,_45,_49}[4] "
            "interpolator.chord_setup.datapath.square_shift{,_17,_21,_25,_29,_33,_37,_41,_45}[5]"
        ),
        "inner sums of the polynomial are 0.046 to 0.050, and 0.125 to 0.132": (
            "interpolator.chord_setup.datapath.horner_2[14-16] "
            "interpolator.chord_setup.datapath.horner_1[12-16]"
        ),
        "the polynomial is less than 0.017": "interpolator.chord_setup.datapath.e_rounded[18]",
        "twice a number is even": (
            "interpolator.{spare,payload,chord_setup.spare}[83] "
            "interpolator.{spare,payload,chord_setup.spare}[214] "
            "interpolator.chord_setup.datapath.{highlight_0_second{,_54},diffuse_0_second}[0] "
            "interpolator.chord_accumulator.{diffuse,highlight}_0_second_difference[0]"
        ),
    },
    "chord_setup": {
        SQUARE: "datapath.{span,u_0_left}_square_2_9[1] datapath.u_0_right_square_{0_9,2_10}[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "datapath.{span,u_0_left}_square_2_9[35] datapath.u_0_right_square_{0_9,2_10}[35] "
            "datapath.{span,u_0_left,u_0_right}_square_partial[36] "
            "datapath.{span,u_0_left,u_0_right}_square_total[36-37] "
            "datapath.{span,u_0_left,u_0_right}_aligned[38-39]"
        ),
        "from the unit vector H to three components up to 1 the squared distance is less than 8": (
            "datapath.u_0_{left,right}_aligned[37]"
        ),
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "datapath.reciprocals.port__data[16] "
            "datapath.reciprocal{,_10,_14,_18,_22,_26,_30,_34,_38,_42}[16] "
            "datapath.square_rounded[16] datapath.square{,_17,_21,_25,_29,_33,_37,_41}[16]"
        ),
        "no square of the table rounds to 1": "datapath.square_rounded[17]",
        "a length of 12 bits takes shifts up to 12, and of a square up to 25": (
            "datapath.shift{,_9,_13,_17,_21,_25,_29,_33,_37,_41,_45,_49}[4] "
            "datapath.square_shift{,_17,_21,_25,_29,_33,_37,_41,_45}[5]"
        ),
        "inner sums of the polynomial are 0.046 to 0.050, and 0.125 to 0.132": (
            "datapath.horner_2[14-16] datapath.horner_1[12-16]"
        ),
        "the polynomial is less than 0.017": "datapath.e_rounded[18]",
        "twice a number is even": (
            "datapath.highlight_0_second{,_54}[0] datapath.diffuse_0_second[0] top.spare[83] top.spare[214]"
        ),
    },
    "difference_setup": {
        "twice a number is even": "top.spare[186] top.spare[230] top.spare[274] datapath.second_{0-2}[0]",
        "a reciprocal is normalised, and so is its square, so that the first bit is 1": (
            "datapath.reciprocal{,s.port__data}[16] datapath.square{,_rounded}[16] "
            "datapath.multiplier_0_{a_0,a_1,0}[16]"
        ),
        "the largest square in the table is under 1 by 62 steps": "datapath.square_rounded[17]",
        "a length of 12 bits takes shifts up to 12, and its square up to 25": (
            "datapath.shift{,_12}[4] datapath.square_shift[5]"
        ),
    },
    "half_chord": {
        "operands are not negative, and less than 1": (
            "datapath.multiplier_0_{a,b}_{0,1}[17] datapath.multiplier_0_{0,1}[17] "
            "datapath.multiplier_0_product{_0,}[34-35]"
        ),
        "from 0 to 90 degrees the factor is 0.636 to 0.708": "datapath.total[14-18] datapath.factor[14-16]",
        "inner sums of its polynomial are smaller still": "datapath.total_3[15-16] datapath.total_2[16]",
        "a root is 1 at most, and that only by rounding": "datapath.root_sum[21] datapath.root_rounded[18]",
    },
    "highlight_cosine": {
        "the table's last value with all of its rise is a step less than 1": "wave.v_6[22]",
        "a product of a number less than 1 and one up to 1 is less than 2": "wave.term_10[26]",
    },
    "highlight_gate": {
        "the exponent stays for a run, so that what follows from it does not fall": (
            "datapath.threshold[0-16] datapath.thresholds.port__data[0-16]"
        ),
        "T (2 - u) is not negative, and less than 2": "datapath.partial_0[36-48]",
    },
    "intensity": {
        "three terms of 8 times the full channel are 6120, less than 2^13": "datapath.rounded_{r,g,b}[13]"
    },
    "light": {
        "a slope is n / 2, and n of 10 bits, normalised to 17, ends in seven zeros": (
            "specular.datapath.slope.slope_word[0-16] specular.datapath.slope.$signal[0-6] "
            "specular.datapath.product[0-6]"
        ),
        "the exponent stays for a run, so that what follows from it does not fall": (
            "specular.datapath.slope.{slope_word[17-26],$signal[7-16],shift[0-3]} "
            "specular.datapath.slope.{boundary,boundaries.port__data}[0-16]"
        ),
        SQUARE: "specular.datapath.square[1]",
    },
    "linear_interpolator": {
        "a straight line has no second difference": (
            "interpolator.{spare,payload,difference_setup.spare}[186-317] "
            "interpolator.difference_accumulator.normal_{0-2}_second_difference[0-43]"
        ),
        "a reciprocal is normalised, so that its first bit is 1": (
            "interpolator.difference_setup.datapath.reciprocal{,s.port__data}[16] "
            "interpolator.difference_setup.datapath.multiplier_0_{a_0,a_1,0}[16]"
        ),
        "a length of 12 bits takes shifts up to 12": (
            "interpolator.difference_setup.datapath.{shift,multiplier_0_2}[4] "
            "interpolator.difference_setup.datapath.multiplier_0_amount_{0-3}[4]"
        ),
        "of the 11 zeros that end a product a shift by 8 leaves 3": (
            "interpolator.difference_setup.datapath.multiplier_0_coarse[0-2]"
        ),
    },
    "local_chord_interpolator": {
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "local_chord_setup.datapath.{reciprocals.port__data,reciprocal,square_rounded,square}[16] "
            "local_chord_setup.datapath.multiplier_{0,1}_b_{0,1}[16] "
            "local_chord_setup.datapath.multiplier_{0,1}_1[16]"
        ),
        "they are not negative, and less than 1": (
            "local_chord_setup.datapath.square_rounded[17] "
            "local_chord_setup.datapath.multiplier_{0,1}_b_{0,1}[17] "
            "local_chord_setup.datapath.multiplier_{0,1}_1[17]"
        ),
        "a length of 12 bits takes shifts up to 12, and of a square up to 25": (
            "local_chord_setup.datapath.shift{,_9,_13}[4] "
            "local_chord_setup.datapath.square_shift{,_17,_21}[5]"
        ),
        "a slope of u has 9 bits less than the word in which it is multiplied": (
            "local_chord_setup.datapath.highlight_0_along[0-4] local_chord_setup.datapath.shifter_0_0[0-4]"
        ),
        "twice a number is even": (
            "local_chord_setup.datapath.{highlight,diffuse}_0_second[0] "
            "chord_accumulator.{highlight,diffuse}_0_second_difference[0] "
            "{top,local_chord_setup}.spare[83] {top,local_chord_setup}.spare[214] "
            "top.payload[83] top.payload[214]"
        ),
        "values have 9 bits less than starts, and those of u are less than 2": (
            "{top,local_chord_setup}.spare[0-8] {top,local_chord_setup}.spare[130-138] "
            "{top,local_chord_setup}.spare[166] top.payload[0-8] top.payload[130-138] top.payload[166]"
        ),
    },
    "local_chord_setup": {
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "datapath.reciprocals.port__data[16] datapath.reciprocal[16] datapath.square_rounded[16] "
            "datapath.square[16] datapath.multiplier_{0,1}_b_{0,1}[16] datapath.multiplier_{0,1}_1[16]"
        ),
        "they are not negative, and less than 1": (
            "datapath.square_rounded[17] datapath.multiplier_{0,1}_b_{0,1}[17] "
            "datapath.multiplier_{0,1}_1[17]"
        ),
        "a length of 12 bits takes shifts up to 12, and of a square up to 25": (
            "datapath.shift{,_9,_13}[4] datapath.square_shift{,_17,_21}[5]"
        ),
        "a slope of u has 9 bits less than the word in which it is multiplied": (
            "datapath.highlight_0_along[0-4] datapath.shifter_0_0[0-4]"
        ),
        "twice a number is even": "datapath.{highlight,diffuse}_0_second[0] top.spare[83] top.spare[214]",
        "values have 9 bits less than starts, and those of u are less than 2": (
            "top.spare[0-8] top.spare[130-138] top.spare[166]"
        ),
    },
    "middle_normal": {
        "the polynomial's products are at most 0.0127 and 0.0293": (
            "datapath.rounded_2[13-16] datapath.rounded_1[14-16]"
        ),
        "its inner sums are 0.0458 to 0.0586 and 0.1250 to 0.1544": "datapath.total_{1,2}[14-16]",
    },
    "pipeline": {
        "a counter stops at its largest value, and a flag that is set stays": (
            "top.status[15] top.status[31-32]"
        ),
        "three terms of 8 times the full channel are 6120, less than 2^13": (
            "intensity.datapath.rounded_{r,g,b}[13]"
        ),
        "a slope is n / 2, and n of 10 bits, normalised to 17, ends in seven zeros": (
            "slope.slope_word[0-16] slope.$signal[0-6] light_0.specular.datapath.product[0-6]"
        ),
        SQUARE: "light_0.specular.datapath.square[1]",
        **QUADRATIC,
    },
    "power": {
        SQUARE: "datapath.x_{0-8}_product[1]",
        "twice a number is even": "datapath.x_{0-8}_sum[0]",
        "p + q - pq is not negative where p and q are 0 to 1": (
            "datapath.x_{0-8}_difference[35] datapath.s_{1-9}_difference[35]"
        ),
    },
    "quadratic_evaluator": {
        SQUARE: "polynomial.datapath.square[1]",
        "a square is not negative": "polynomial.datapath.square[35]",
        "a reciprocal is normalised, so that its first bit is 1": (
            "step.datapath.reciprocal{,s.port__data}[17]"
        ),
        "a length of 12 bits takes shifts up to 12": "step.datapath.shift[4]",
    },
    "quadratic_interpolator": QUADRATIC,
    "recurrence_interpolator": {
        SQUARE: "interpolator.recurrence_setup.datapath.span_square_2_9[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "interpolator.recurrence_setup.datapath.span_square_2_9[35] "
            "interpolator.recurrence_setup.datapath.span_square_partial[36] "
            "interpolator.recurrence_setup.datapath.span_square_total[36-37] "
            "interpolator.recurrence_setup.datapath.span_aligned[38-39]"
        ),
        "all words that are read of a table have the same bit there": (
            "interpolator.recurrence_setup.datapath.chord_entry{,_22}[12-13] "
            "interpolator.recurrence_setup.datapath.chord_entry{,_22}[34-35] "
            "interpolator.recurrence_setup.datapath.chord_entry{,_22}[49] "
            "interpolator.recurrence_setup.datapath.step_entry{,_54}[10-13] "
            "interpolator.recurrence_setup.datapath.step_entry{,_54}[34-35] "
            "interpolator.recurrence_setup.datapath.step_entry{,_54}[47-49] "
            "interpolator.recurrence_setup.datapath.step_entry{,_54}[71] "
            "interpolator.recurrence_setup.datapath.phase_entry{,_54}[10-13] "
            "interpolator.recurrence_setup.datapath.phase_entry{,_54}[35] "
            "interpolator.recurrence_setup.datapath.chord_tables.port__data[12-13] "
            "interpolator.recurrence_setup.datapath.chord_tables.port__data[34-35] "
            "interpolator.recurrence_setup.datapath.chord_tables.port__data[49] "
            "interpolator.recurrence_setup.datapath.step_tables.port__data[10-13] "
            "interpolator.recurrence_setup.datapath.step_tables.port__data[34-35] "
            "interpolator.recurrence_setup.datapath.step_tables.port__data[47-49] "
            "interpolator.recurrence_setup.datapath.step_tables.port__data[71] "
            "interpolator.recurrence_setup.datapath.phase_tables.port__data[10-13] "
            "interpolator.recurrence_setup.datapath.phase_tables.port__data[35]"
        ),
        "the excess of the square of an angle is less than 1/4, that of an angle less than 1": (
            "interpolator.recurrence_setup.datapath.chord_0_sum[20-22] "
            "interpolator.recurrence_setup.datapath.chord_0_rounded[15-18] "
            "interpolator.recurrence_setup.datapath.chord_0[15-16] "
            "interpolator.recurrence_setup.datapath.chord_1_sum[22] "
            "interpolator.recurrence_setup.datapath.chord_1_rounded[17-18]"
        ),
        "what a step bends is less than 1/4, its sine's deficiency and what four steps bend less than 1/2": (
            "interpolator.recurrence_setup.datapath.step_0_sum[20-22] "
            "interpolator.recurrence_setup.datapath.step_0_rounded[15-18] "
            "interpolator.recurrence_setup.datapath.step_0[15-16] "
            "interpolator.recurrence_setup.datapath.step_1_sum[21-22] "
            "interpolator.recurrence_setup.datapath.step_1_rounded[16-18] "
            "interpolator.recurrence_setup.datapath.step_1[16] "
            "interpolator.recurrence_setup.datapath.phase_0_sum[21-22] "
            "interpolator.recurrence_setup.datapath.phase_0_rounded[16-18] "
            "interpolator.recurrence_setup.datapath.phase_0[16]"
        ),
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "interpolator.recurrence_setup.datapath.reciprocal_entry[16] "
            "interpolator.recurrence_setup.datapath.reciprocal_entry[33] "
            "interpolator.recurrence_setup.datapath.reciprocal[16] "
            "interpolator.recurrence_setup.datapath.reciprocal_square[16] "
            "interpolator.recurrence_setup.datapath.reciprocals.port__data[16] "
            "interpolator.recurrence_setup.datapath.reciprocals.port__data[33] "
            "interpolator.recurrence_setup.datapath.reciprocal_{11,15,19,23,27,31,35,39,43,47,51,55,59}[16] "
            "interpolator.recurrence_setup.datapath.reciprocal_{63,67,71}[16] "
            "interpolator.recurrence_setup.datapath.reciprocal_square_{11,15,19,23,27,31,35}[16]"
        ),
        "an eighth of Q is at most 0.31, so that its word, which is 1/2 or more, is shifted": (
            "interpolator.recurrence_setup.datapath.step_fine[27]"
        ),
        "Q less its bend is not negative, and less than 1, to which it is not rounded up": (
            "interpolator.recurrence_setup.datapath.step_coefficient_exact[34] "
            "interpolator.recurrence_setup.datapath.step_coefficient_rounded[17-18] "
            "interpolator.recurrence_setup.datapath.phase_coefficient_exact[34] "
            "interpolator.recurrence_setup.datapath.phase_coefficient_rounded[17-18]"
        ),
        "the excess of an angle is at least what the sine of a part of it lacks": (
            "interpolator.recurrence_setup.datapath.excess_difference{,_63}[17]"
        ),
        "rho is 1/2 or more, after it is halved where it is 1 or more, and less than 2 before": (
            "interpolator.recurrence_setup.datapath.rho_exact[35] "
            "interpolator.recurrence_setup.datapath.rho_halved[35] "
            "interpolator.recurrence_setup.datapath.rho_rounded[18] "
            "interpolator.recurrence_setup.datapath.rho[16]"
        ),
        "a cosine has ten bits less than x": (
            "interpolator.{spare,payload,recurrence_setup.spare}[0-9] "
            "interpolator.{spare,payload,recurrence_setup.spare}[368-377] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_x_0[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_x_0_{15,19,23,27,31,35,39,43}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_x_0_{47,51,55,59,63,67,71,75}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_x_0_{79,83,87,91,95,99,103}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_x_0_{107,111,115}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{16,20,24,28}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{32,36,40,44}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{48,52,56,60}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{64,68,72,76}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{80,84,88,92}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{96,100,104}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{108,112,116}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{120,124,128}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{132,136,140}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_{144,148,152}[0-9] "
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_start_0_first_156[0-9]"
        ),
        "what is shifted ends in zeros": (
            "interpolator.recurrence_setup.datapath.shifter_2_0[0-12] "
            "interpolator.recurrence_setup.datapath.shifter_3_0[0-12] "
            "interpolator.recurrence_setup.datapath.shifter_4_0[0-12]"
        ),
        "a cosine and twice a difference are even": (
            "interpolator.recurrence_setup.datapath.{diffuse,highlight}_0_sum_1{,_92}[0]"
        ),
    },
    "recurrence_setup": {
        SQUARE: "datapath.span_square_2_9[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "datapath.span_square_partial[36] datapath.span_square_2_9[35] datapath.span_square_total[36-37] "
            "datapath.span_aligned[38-39]"
        ),
        "all words that are read of a table have the same bit there": (
            "datapath.chord_entry{,_22}[12-13] datapath.chord_entry{,_22}[34-35] "
            "datapath.chord_entry{,_22}[49] datapath.step_entry{,_54}[10-13] "
            "datapath.step_entry{,_54}[34-35] datapath.step_entry{,_54}[47-49] datapath.step_entry{,_54}[71] "
            "datapath.phase_entry{,_54}[10-13] datapath.phase_entry{,_54}[35] "
            "datapath.chord_tables.port__data[12-13] datapath.chord_tables.port__data[34-35] "
            "datapath.chord_tables.port__data[49] datapath.step_tables.port__data[10-13] "
            "datapath.step_tables.port__data[34-35] datapath.step_tables.port__data[47-49] "
            "datapath.step_tables.port__data[71] datapath.phase_tables.port__data[10-13] "
            "datapath.phase_tables.port__data[35]"
        ),
        "the excess of the square of an angle is less than 1/4, that of an angle less than 1": (
            "datapath.chord_0_sum[20-22] datapath.chord_0_rounded[15-18] datapath.chord_0[15-16] "
            "datapath.chord_1_sum[22] datapath.chord_1_rounded[17-18]"
        ),
        "what a step bends is less than 1/4, its sine's deficiency and what four steps bend less than 1/2": (
            "datapath.step_0_sum[20-22] datapath.step_0_rounded[15-18] datapath.step_0[15-16] "
            "datapath.step_1_sum[21-22] datapath.step_1_rounded[16-18] datapath.step_1[16] "
            "datapath.phase_0_sum[21-22] datapath.phase_0_rounded[16-18] datapath.phase_0[16]"
        ),
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "datapath.reciprocal_entry[16] datapath.reciprocal_entry[33] "
            "datapath.reciprocal{,_11,_15,_19,_23,_27,_31,_35,_39,_43,_47,_51,_55,_59,_63,_67,_71}[16] "
            "datapath.reciprocal_square{,_11,_15,_19,_23,_27,_31,_35}[16] "
            "datapath.reciprocals.port__data[16] datapath.reciprocals.port__data[33]"
        ),
        "a square rounds up to 1 in one span in 2^17 alone": (
            "datapath.psi_square_rounded[17] datapath.q_square_rounded[17]"
        ),
        "an eighth of Q is at most 0.31, so that its word, which is 1/2 or more, is shifted": (
            "datapath.step_fine[27]"
        ),
        "Q less its bend is not negative, and less than 1, to which it is not rounded up": (
            "datapath.step_coefficient_exact[34] datapath.step_coefficient_rounded[17-18] "
            "datapath.phase_coefficient_exact[34] datapath.phase_coefficient_rounded[17-18]"
        ),
        "the excess of an angle is at least what the sine of a part of it lacks": (
            "datapath.excess_difference{,_63}[17]"
        ),
        "rho is 1/2 or more, after it is halved where it is 1 or more, and less than 2 before": (
            "datapath.rho_exact[35] datapath.rho_halved[35] datapath.rho_rounded[18] datapath.rho[16]"
        ),
        "a cosine has ten bits less than x": (
            "top.spare[0-9] top.spare[368-377] "
            "datapath.{diffuse,highlight}_0_x_0{,_15,_19,_23,_27,_31,_35,_39,_43,_47,_51,_55,_59}[0-9] "
            "datapath.{diffuse,highlight}_0_x_0{_63,_67,_71,_75,_79,_83,_87,_91,_95,_99,_103,_107}[0-9] "
            "datapath.{diffuse,highlight}_0_x_0{_111,_115}[0-9] "
            "datapath.{diffuse,highlight}_0_start_0_first{,_16,_20,_24,_28,_32,_36,_40,_44,_48,_52}[0-9] "
            "datapath.{diffuse,highlight}_0_start_0_first{_56,_60,_64,_68,_72,_76,_80,_84,_88,_92}[0-9] "
            "datapath.{diffuse,highlight}_0_start_0_first{_96,_100,_104,_108,_112,_116,_120,_124}[0-9] "
            "datapath.{diffuse,highlight}_0_start_0_first{_128,_132,_136,_140,_144,_148,_152,_156}[0-9]"
        ),
        "what is shifted ends in zeros": (
            "datapath.shifter_2_0[0-12] datapath.shifter_3_0[0-12] datapath.shifter_4_0[0-12]"
        ),
        "a cosine and twice a difference are even": "datapath.{diffuse,highlight}_0_sum_1{,_92}[0]",
    },
    "renormaliser": {
        "a vector comes on every clock, and is taken": (
            "datapath.dot_product.ages[0-2] datapath.dot_product.held[0]"
        ),
        SQUARE: "datapath.dot_product.datapath.{product_0,product_1,product_2,last_product}[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "datapath.dot_product.datapath.{product_0,product_1,product_2,last_product}[35] "
            "datapath.dot_product.datapath.partial_sum[36] "
            "datapath.dot_product.{datapath.sum,spare}[36-37]"
        ),
    },
    "specular": {
        "a slope is n / 2, and n of 10 bits, normalised to 17, ends in seven zeros": (
            "datapath.slope.slope_word[0-16] datapath.slope.$signal[0-6] datapath.product[0-6]"
        ),
        "the exponent stays for a run, so that what follows from it does not fall": (
            "datapath.slope.{slope_word[17-26],$signal[7-16],shift[0-3]} "
            "datapath.slope.{boundary,boundaries.port__data}[0-16]"
        ),
        SQUARE: "datapath.square[1]",
    },
}


class Edges(Wrapped):
    """A unit, and of each bit of its registers whether it has risen and fallen.

    Registers are put together in words of 32 bits, as for `ToggleCounter`.
    """

    def __init__(self, unit, within=""):
        self.within = within
        registers = self.registers(Fragment.get(unit, None))
        self.names = [f"{path}[{bit}]" for path, signal in registers for bit in range(len(signal))]
        edges = data.ArrayLayout(32, -(-len(self.names) // 32))
        super().__init__(unit, status=Out(data.StructLayout({"toggled": edges})))

    def registers(self, fragment):
        """Path and signal of each, in a fixed order."""
        return [
            (f"{path}.{getattr(signal, 'name', 'data')}", signal)
            for path, signals in _registers(fragment).items()
            if path == self.within or path.startswith(f"{self.within}." if self.within else "")
            for signal in signals
        ]

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.submodules.unit = fragment = Fragment.get(self.unit, platform)
        for index, (now, init) in enumerate(_words([signal for _, signal in self.registers(fragment)])):
            before = Signal(len(now), init=init)
            rose, fell = Signal(len(now), name="rose"), Signal(len(now), name="fell")
            m.d.sync += [before.eq(now), rose.eq(rose | now & ~before), fell.eq(fell | before & ~now)]
            m.d.comb += self.status.toggled[index].eq(rose & fell)
        return m


def still_bits(unit, vectors, within=""):
    """Names of the register bits that do not rise, or do not fall."""
    edges = Edges(unit, within)
    model = Model(edges)
    seen = np.bitwise_or.reduce([model.run(stimulus, None).status[0] for stimulus, _ in vectors])
    toggled = np.unpackbits(seen.astype("<u4").view(np.uint8), bitorder="little")
    return [name for name, both in zip(edges.names, toggled, strict=False) if not both]


def expanded(text):
    """Names that a text with ``{a,b}``, ``{0-8}`` and ``[14-18]`` stands for."""
    if found := re.search(r"\{([^{}]*)\}", text):
        parts = [part for choice in found[1].split(",") for part in spread(choice)]
        return [n for part in parts for n in expanded(text[: found.start()] + part + text[found.end() :])]
    word, bits = re.fullmatch(r"(.*)\[(.*)\]", text).groups()
    return [f"{word}[{bit}]" for bit in spread(bits)]


def spread(text):
    """Numbers of a range, ``0-8``; else the text itself."""
    found = re.fullmatch(r"(\d+)-(\d+)", text)
    return [str(n) for n in range(int(found[1]), int(found[2]) + 1)] if found else [text]


@pytest.fixture
def long_numbers():
    """Amaranth writes a mask of all registers as a decimal number."""
    digits = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    yield
    sys.set_int_max_str_digits(digits)


@pytest.mark.long
@pytest.mark.usefixtures("long_numbers")
@pytest.mark.parametrize("name", DEVICES)
def test_every_register_bit_rises_and_falls(name):
    device = DEVICES[name]
    argued = [n for words in STILL.get(name, {}).values() for word in words.split() for n in expanded(word)]
    assert set(still_bits(device.unit(), vectors_of(name), device.within)) == set(argued)
