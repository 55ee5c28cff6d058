"""Methods and reflection models in a line each, for the help of the command line."""

__all__ = ["METHOD_LINES", "MODEL_LINES", "described"]

METHOD_LINES = {
    "chord": "no normals: 1 - N.H is nearly a quadratic along a span; exact, a pixel a cycle",
    "chord-local": "the same for point lights and a near viewer",
    "renormalise": "the true line between normals, each divided by its length; exact, never cut",
    "linear": "a straight line between the ends, not normalised: highlights go dull",
    "quadratic": "a quadratic through three normals, by differences",
    "quadratic-eval": "the same quadratic, evaluated at every pixel",
    "quadratic-horner": "the same quadratic by Horner's rule",
    "angular": "equal angles on the great circle, from sines",
    "recurrence": "equal angles on the great circle, each normal from the two before",
    "bisection": "spans halved until straight lines will do",
    "bisection-published": "with the polynomials that the thesis prints",
    "quadratic-published": "as the thesis prints it",
    "angular-published": "as the thesis prints it",
    "angular-corrected": "as printed, with the arccosine corrected",
    "recurrence-direct": "the recurrence as drawn, which is unstable",
}

MODEL_LINES = {
    "blinn": "(N.H)^n, exact, from a small table that is written for each frame",
    "ggx": "the lobe of glTF, from a table, by roughness",
    "beckmann": "Beckmann's lobe, from a table, by roughness",
    "phong_coplanar": "Phong's (R.V)^n where all vectors lie in a plane, from a table",
    "cosquad": "the thesis's cosine-quadratic: (1 - n/2 (1 - N.H))^2, or 0",
    "cosquad7": "the same with the slope 7/16 n",
    "cosquad_q": "the same with the slope that meets Blinn's power exactly at a level",
    "cosquad_lin": "the same with a slope that is a line in n, as printed",
    "cosquad_lin_refitted": "the same with a line fitted to that of cosquad_q",
    "lyon2": "Lyon's fourth power of a line in N.H",
    "lyon3": "Lyon's eighth power of a line in N.H",
    "lyon1_refitted": "a square of a line in N.H, fitted over all exponents",
    "lyon2_refitted": "a fourth power, fitted",
    "lyon3_refitted": "an eighth power, fitted",
    "coscos2": "a squared cosine of a multiple of the angle",
    "coscos4": "a fourth power of a cosine of a multiple of the angle",
    "coscos2_integral": "coscos2 with the same integral as Blinn's power",
    "coscos4_integral": "coscos4 with the same integral as Blinn's power",
    "exp": "exp(-n (1 - N.H)), to which Blinn's power tends",
    "blinn_product": "(N.H)^n by repeated squaring, exact",
    "phong": "(R.V)^n with the mirrored ray; not every method serves it",
}


def described(lines: dict[str, str]) -> str:
    """Names and texts in columns, a line each."""
    width = max(map(len, lines)) + 2
    return "\n".join(f"    {name:<{width}}{text}" for name, text in lines.items())
