"""Instance and category labels for segmentation images."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene.scene import Scene

BACKGROUND = -1
HOUSE, PERSON, RECEPTACLE = "house", "person", "receptacle"
_PERSON_ROOT = "avatar/base"


@dataclass(frozen=True, eq=False)
class Labels:
    """A mapping from geom ids to instance numbers and category numbers. The background is always -1."""

    # instance names, indexed by instance number: `house`, `person`, the receptacle keys and the object names
    instances: tuple[str, ...]
    # category names, indexed by category number: `house`, `person`, `receptacle` and the object categories
    categories: tuple[str, ...]
    # instance number of each geom, followed by -1 for the background, shape (ngeom + 1,)
    instance_of_geom: NDArray[np.int32]
    # category number of each instance, followed by -1 for the background
    category_of_instance: NDArray[np.int32]

    @classmethod
    def of(cls, scene: Scene) -> "Labels":
        """Create the labels for a composed scene. Scenes of equal episodes have equal labels."""
        model, keys = scene.model, tuple(scene.receptacles)
        instances = (HOUSE, PERSON, *keys, *scene.index.names)
        of_geom = np.zeros(model.ngeom + 1, np.int32)
        of_geom[-1] = BACKGROUND
        person = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, _PERSON_ROOT)
        if person >= 0:
            of_geom[:-1][model.body_rootid[model.geom_bodyid] == person] = 1
        prefixes = [model.geom(geom).name.partition("/")[0] for geom in range(model.ngeom)]
        for number, key in enumerate(keys, start=2):
            of_geom[:-1][[prefix == key for prefix in prefixes]] = number
        owner = scene.index.geom_owner
        of_geom[:-1][owner >= 0] = owner[owner >= 0] + 2 + len(keys)
        kinds = [placed.category for placed in scene.episode.objects]
        categories = (HOUSE, PERSON, RECEPTACLE, *scene.catalogue.categories)
        of_instance = [0, 1, *[2] * len(keys), *(categories.index(kind, 3) for kind in kinds), BACKGROUND]
        return cls(instances, categories, of_geom, np.array(of_instance, np.int32))

    def instance_map(self, segmentation: NDArray[np.int32]) -> NDArray[np.int32]:
        """Convert an array of geom ids to instance numbers."""
        return np.asarray(self.instance_of_geom[segmentation])

    def category_map(self, segmentation: NDArray[np.int32]) -> NDArray[np.int32]:
        """Convert an array of geom ids to category numbers."""
        return np.asarray(self.category_of_instance[self.instance_of_geom[segmentation]])

    def pixel_counts(self, segmentation: NDArray[np.int32]) -> dict[str, int]:
        """Count the pixels of each visible instance in an array of geom ids. Keys are instance names."""
        seen = self.instance_of_geom[segmentation].ravel()
        counts = np.bincount(seen[seen >= 0], minlength=len(self.instances))
        return {name: int(count) for name, count in zip(self.instances, counts, strict=True) if count}
