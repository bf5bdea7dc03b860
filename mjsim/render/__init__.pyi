from .cameras import CameraPose as CameraPose
from .context import GlInfo as GlInfo, gl_info as gl_info
from .labels import Labels as Labels
from .markers import MarkerLike as MarkerLike
from .pictures import (
    FloorPlanPicture as FloorPlanPicture,
    largest_scale as largest_scale,
    render_floorplan as render_floorplan,
    render_house_map as render_house_map,
    render_picture as render_picture,
    render_pictures as render_pictures,
)
from .profiles import (
    DRAFT as DRAFT,
    FAST as FAST,
    PROFILES as PROFILES,
    QUALITY as QUALITY,
    RenderProfile as RenderProfile,
)
from .renderer import Frame as Frame, LayeredRenderer as LayeredRenderer, Renderer as Renderer
