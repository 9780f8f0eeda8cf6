"""The colours, red-green-blue 0 … 255; those of mark, crack and the like are used for nothing else."""

Colour = tuple[int, int, int]

PAGE: Colour = (243, 245, 247)
WHITE: Colour = (255, 255, 255)
PANEL = WHITE
BORDER: Colour = (214, 219, 224)
GRID: Colour = (230, 233, 237)
INK: Colour = (38, 46, 56)
QUIET: Colour = (104, 114, 126)

STEEL: Colour = (176, 187, 198)
STEEL_LIGHT: Colour = (214, 221, 228)
STEEL_DARK: Colour = (112, 125, 139)
HOUSING: Colour = (196, 202, 196)
HOUSING_EDGE: Colour = (138, 147, 138)

# Okabe and Ito's colours, told apart by colour-blind readers too
MARK: Colour = (0, 158, 115)
CONTACT: Colour = (230, 159, 0)
THEORY: Colour = (0, 114, 178)
REAL: Colour = (213, 94, 0)
CRACK: Colour = (176, 52, 148)
LOOSE: Colour = (200, 16, 46)
MOTION: Colour = (86, 180, 233)


def blend(one: Colour, other: Colour, share: float) -> Colour:
    """The colour at a share 0 … 1 of the way from one to the other."""
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(one, other, strict=True))
    return red, green, blue
