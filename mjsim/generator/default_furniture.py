"""Required and default furniture for each room use, and the rooms that suit each bin."""

Options = tuple[str, ...]

REQUIRED: dict[str, tuple[Options, ...]] = {  # each room gets one piece from each tuple
    "bedroom": (("double_bed",),),
    "child": (("single_bed", "bunk_bed"),),
    "studio": (("double_bed", "single_bed"),),
    "bathroom": (("bathtub", "shower"), ("toilet",), ("washbasin",)),
    "shower_room": (("shower",), ("toilet",), ("washbasin",)),
}
PLANTS: Options = ("bush", "tree", "snake_plant", "palm", "cactus", "fern_stand")
_SHELVES: Options = ("bookcase", "low_bookcase", "cube_shelf", "ladder_shelf")
# Each entry contains furniture types and the probability that one of them is added to a room with space.
DEFAULTS: dict[str, tuple[tuple[Options, float], ...]] = {
    "bedroom": (
        (("chest_of_drawers", "dressing_table"), 1.0),
        (("standing_mirror", "armchair", "pouf", "bench"), 0.7),
        (PLANTS, 0.7),
        ((*_SHELVES, "trunk", "television"), 0.6),
        (("floor_lamp", "chest_of_drawers"), 0.5),
    ),
    "child": (
        (("chest_of_drawers", "toy_shelf"), 0.8),
        (("toy_shelf", "low_bookcase", "cube_shelf"), 0.9),
        (("desk",), 0.6),
        (("pouf", "stool", "trunk", "aquarium"), 0.7),
        (PLANTS, 0.3),
    ),
    "living_room": (
        (("armchair",), 0.8),
        ((*_SHELVES, "sideboard", "display_cabinet"), 0.9),
        (PLANTS, 0.9),
        (("floor_lamp", "side_table"), 0.8),
        (("sideboard", "piano", "stove", "aquarium", "chest_of_drawers"), 0.8),
        (("armchair", "pouf", "day_bed"), 0.6),
        ((*_SHELVES, "trunk", "console"), 0.7),
        (PLANTS, 0.3),
    ),
    "studio": (
        (("chest_of_drawers", "low_bookcase", "cube_shelf"), 1.0),
        (_SHELVES, 0.7),
        (PLANTS, 0.8),
        (("floor_lamp", "armchair"), 0.6),
    ),
    "kitchen": (
        (("bar_table", "larder", "dresser", "kitchen_trolley"), 0.9),
        (("bench", "stool"), 0.3),
        (PLANTS, 0.4),
    ),
    "dining_room": (
        (("sideboard", "dresser", "display_cabinet"), 1.0),
        (PLANTS, 0.8),
        (("bookcase", "ladder_shelf", "console", "stove", "piano", "bench"), 0.7),
        (("floor_lamp", "armchair"), 0.5),
    ),
    "office": (
        (("desk",), 1.0),
        (_SHELVES, 1.0),
        (("filing_cabinet",), 0.8),
        (("armchair", "day_bed", "sofa"), 0.7),
        (PLANTS, 0.8),
        (("floor_lamp", "side_table", *_SHELVES), 0.6),
    ),
    "bathroom": (
        (("washing_machine", "washing_tower", "bath_cabinet"), 0.9),
        (("towel_rail", "towel_shelf", "bath_cabinet"), 0.9),
        (("snake_plant", "fern_stand", "stool", "drying_rack"), 0.6),
    ),
    "shower_room": ((("towel_rail", "bath_cabinet", "towel_shelf"), 0.9),),
    "utility": (
        (("washing_machine", "washing_tower"), 1.0),
        (("towel_shelf", "larder", "fridge"), 1.0),
        (("drying_rack",), 0.8),
    ),
    "hall": (
        (("coat_rack", "shoe_cupboard"), 1.0),
        (("console", "bench", "shoe_cupboard", "chest_of_drawers"), 0.9),
        (("umbrella_stand",), 0.7),
        (PLANTS, 0.7),
        (("mirror_wardrobe", "low_bookcase", "armchair", "standing_mirror"), 0.6),
    ),
}
# Furniture for rooms in which nothing else fits.
FALLBACKS: Options = ("standing_mirror", "umbrella_stand", "snake_plant", "stool")
MAX_PLANTS = 2  # maximum number of plants per room
_RARE = ("aquarium", "piano", "stove", "larder", "dresser", "kitchen_trolley", "cactus")
_SCARCE = ("bush", "tree", "palm", "fern_stand", "snake_plant", "pouf", "television")
# Maximum number of pieces of a kind per home. Other kinds have no limit.
MAX_IN_HOME = dict.fromkeys(_RARE, 1) | dict.fromkeys(_SCARCE, 2)
ROUNDS = 3  # number of passes through the lists of default furniture
MAX_OF_KIND = {
    "armchair": 2,
    "bush": 2,
    "bookcase": 2,
    "low_bookcase": 2,
    "sideboard": 2,
}  # maximum number of pieces per room; the default is 1
# Minimum and maximum share of a room's floor that furniture covers.
FURNISHED_SHARES = {"hall": (0.15, 0.25), "living_room": (0.31, 0.38), "studio": (0.33, 0.4)}
# Room uses for a kitchen, a table and a desk, in order of preference. "child" is a child's bedroom.
COOKING: Options = ("kitchen", "living_room", "studio", "dining_room")
DINING: Options = ("dining_room", "kitchen", "living_room", "studio")
WORKING: Options = ("office", "child", "bedroom", "studio", "living_room", "dining_room", "hall")
BIN_ROOMS: dict[str, Options] = {  # suitable room uses for each bin, in order of preference
    "recycling_bin": ("kitchen", "utility", "hall", "studio", "living_room", "dining_room"),
    "laundry_hamper": ("bathroom", "shower_room", "utility", "bedroom", "hall", "studio"),
    "toy_box": ("child", "bedroom", "living_room", "studio", "hall", "office", "dining_room"),
    "bookshelf": ("living_room", "studio", "office", "dining_room", "hall", "bedroom", "child"),
}
SHOWN_NAMES = {  # names of furniture types in descriptions of places
    "lounge": "sofa",
    "dining": "dining table",
    "straight_kitchen": "kitchen counter",
    "corner_kitchen": "kitchen counter",
    "kitchenette": "kitchen counter",
    "double_bed": "bed",
    "single_bed": "bed",
}
