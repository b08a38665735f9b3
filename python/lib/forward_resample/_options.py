"""The options of each command with their types, as checkers and editors see them. Made by ``python/tests/typed_options.py``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Literal, TypedDict, Union

#: A word of the command line: text, a number, the name of a file, or what goes into JSON.
Value = Union[str, int, float, "os.PathLike[str]", dict[str, Any], list[Any], tuple[Any, ...]]

#: Numbers with commas between them.
Numbers = Union[str, float, Sequence[float]]

#: Two numbers, or pairs of numbers.
Curve = Union[str, Sequence[float], Sequence[Sequence[float]]]

#: Width and height, or columns and rows.
Size = Union[str, tuple[int, int], Sequence[int]]


class SharedOptions(TypedDict, total=False):
    """The options of every command."""

    #: Move through the keys of a file, each with a time in seconds and a camera, in numbered pictures
    path: Value
    #: The fastest setting whose error stays under BOUND, such as 1/255 or 0.004: the root mean square over the covered pixels, against the most exact setting; max:1/64 bounds the largest change of any pixel
    max_error: Value
    #: The most accurate setting that is predicted to take no longer than TIME a picture, such as 50ms or 2s
    max_time: Value
    #: Print the chosen setting, the reason, and the error and saving of the others
    explain: bool
    #: Bits per channel of a PNG [default: 8]
    bits: Value
    #: Background: transparent, white, black, #rrggbb, R,G,B from 0 to 255 (sRGB), or a picture file, which is scaled until it covers the picture [default: transparent]
    background: Value


class FramedOptions(SharedOptions, total=False):
    """The options of a camera around a scene."""

    #: Most memory to work in, such as 4G or 512M [default: three quarters of what this machine or its control group has]
    max_memory: Value
    #: Follow names inside files out of the folder of the file that is typed
    allow_outside: bool
    #: Also write the view as a camera file, from which --camera draws the same bytes
    save_camera: Value
    #: Azimuth and elevation of the eye in degrees, around the visible part; DIST multiplies the distance at which that fills 0.85 of the picture (orthographic: the height of the view) [default: 30,20,1]
    orbit: Numbers
    #: Vertical field of view in degrees, where no camera file gives one
    fov: Value
    #: World axis that points up in the picture [default: as stored in the file, else y; of Gaussians in PLY, .splat and SOG -y]
    up: Value
    #: Perspective or parallel view
    projection: Literal["perspective", "orthographic"]
    #: Go once around the visible part in N numbered pictures, from --orbit's azimuth on
    turntable: Value
    #: Pictures per second of an animation or of --path [default: 25]
    fps: Value
    #: Draw a bar of a round length, or of LENGTH world units
    scale_bar: Union[bool, Value]
    #: Draw the colours of the values, under TITLE
    colour_bar: Union[bool, Value]
    #: Draw the axes of the world: their directions in a corner, or a box around the scene with numbers
    axes: Union[bool, Literal["directions", "box"]]
    #: Write a line of text at the top
    caption: Value


class VolumeOptions(FramedOptions, total=False):
    """The options of ``resample volsplat``."""

    #: Number of voxels along x, y and z (raw files)
    dims: Numbers
    #: Type of a voxel: u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64 (raw files)
    type: Value
    #: Byte order: little (default) or big (raw files)
    endian: Value
    #: Bytes before the first voxel, 0 if not given (raw files)
    skip: Value
    #: Value that stands for NaN; without it, a volume that holds NaN is an error
    nan_as: Value
    #: Multiply every value by SCALE and add OFFSET, such as 1,-1024 for a raw CT
    rescale_values: Numbers
    #: Colour space of the colours in the transfer function file
    transfer_space: Literal["linear", "srgb"]
    #: Move the file's knots, from the first to the last, to the range of the volume's values
    rescale_transfer: bool
    #: Values LOW to HIGH, or LEVEL - WIDTH/2 to LEVEL + WIDTH/2, span the colour map and an opacity from 0 to 1, as in CT: 40,400 or -160..240
    window: Numbers
    #: Preset: transfer function, shading and blend mode, such as ct-bone, mr-head, green-channel, flame; `list` prints all
    preset: Value
    #: Colour map of the window, or of the transfer function that is made from the histogram [default: viridis]
    colormap: Value
    #: Multiply the extinction of any transfer function: an opacity A becomes 1 - (1 - A)^S
    opacity_scale: Value
    #: Length in world units over which an opacity is meant [default: the smallest distance between voxels]
    opacity_unit: Value
    #: Also draw the transfer function over the histogram of the volume, as a PNG
    show_transfer: Value
    #: The values are labels: never interpolated, each with a colour of its own; 0 is not drawn
    labels: bool
    #: Colours and opacities of labels: a label file of ITK-SNAP, CSV, or JSON; labels that it does not list are not drawn
    label_colours: Value
    #: Draw this channel of the file, by its number from 0 on or its name, such as GFP:green:200,4000:gamma=0.8:opacity=1
    channel: Any
    #: Mesh that stands in the volume, in the volume's world coordinates; may be given several times
    mesh: Any
    #: Surface of a value inside the volume, beside the volume itself; may be given several times
    with_iso: Any
    #: Slice that stands in the volume; may be given several times
    with_slice: Any
    #: The step of a volume over time that decides look and view, counted from 0; all: the values of all of them
    look_of: Value
    #: Order of compositing [default: field; an option that only one order has selects that order, and a single slice is drawn by every-sample]
    order: Literal["field", "every-sample", "axis-sheets", "image-sheets"]
    #: Thickness of a slab along the view, in voxels (the smallest spacing)
    slab: Value
    #: Sub-pixels along a pixel's side: 1, 2, 4, 8, 16, or auto: about two per voxel (field), one per sample (every-sample), 1 (axis-sheets)
    subpixels: Value
    #: How the opacity of a voxel becomes the opacity of a pixel
    opacity: Literal["extinction", "linear"]
    #: Stop a ray once its remaining transmittance falls below T (0: never)
    min_transmittance: Value
    #: SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    vector_level: Literal["auto", "avx2", "baseline"]
    #: How samples are lit, by the gradient of the volume [default: as the preset or the data have it; with --transfer, --window or --colormap none; of an isosurface phong]
    shade: Literal["none", "lambert", "phong"]
    #: Gradient that light follows
    gradient_filter: Literal["smooth", "central"]
    #: Direction towards the light, in the world [default: the light is at the camera]
    light: Numbers
    #: The volume casts shadows on itself, in the light from --light
    shadows: bool
    #: Diameter of the light of shadows as they see it, degrees: the sun has 0.5, 0 makes hard shadows
    light_size: Value
    #: The volume hides light of the sky from itself: depth reads. Matter farther away than RADIUS does not count, world units [default: a tenth of the visible part's diagonal]
    occlusion: Union[bool, Value]
    #: Light of shadows and occlusion is found at each voxel, or at one of 2, 4 or 8 along each axis, which is quicker and errs more [default: each voxel; in a file, as many as fit the memory]
    light_grid: Value
    #: Multiply the extinction by a factor over the length of the gradient, value per world unit: 0 at LOW and 1 at HIGH, or a curve such as 0:0.1,10:0.1,40:1
    gradient_opacity: Curve
    #: Draw only the inside of a box along the world's axes, from the first corner to the second
    crop: Numbers
    #: Draw only a box of voxels, from the first to the last, both included
    crop_voxels: Numbers
    #: Draw only the side of a plane where NX x + NY y + NZ z >= D, in the world; up to six times
    clip_plane: Any
    #: The value of its ray that a pixel shows [default: emission, or isosurface with --iso]
    blend: Literal["emission", "maximum", "minimum", "average", "isosurface"]
    #: Draw the surface at this value, lit by the gradient
    iso: Value
    #: Colour of the surface: white, black, #rrggbb, or R,G,B from 0 to 255 [default: the transfer function's]
    iso_colour: Value
    #: Opacity of the surface, each time that a ray crosses it; above 0, at most 1 [default: 1]
    iso_opacity: Value
    #: Planes of an EXR file beside colour and mean depth (Z) [default: none]
    layers: Any
    #: Shape of the reconstruction kernel
    kernel: Literal["gaussian", "polynomial", "b-spline"]
    #: How a perspective footprint is evaluated (not in image sheets)
    footprint: Literal["affine-approx", "affine", "table", "exact"]
    #: Choice of points and splats; image sheets have no EWA
    select: Literal["hybrid", "points", "splats", "ewa"]
    #: In hybrid: samples whose spacing projects to less than this many pixels are points
    point_threshold: Value
    #: Depth range within which points are summed before they are composited, in voxels (every sample)
    sheet: Value
    #: Source of a sample's colour (not in image sheets)
    colour_by: Literal["transfer", "select"]
    #: The part of the volume that a sample stands for: off, mean, split, split:E, or auto (split in every-sample, off in the other orders)
    cells: Value
    #: Input of the transfer function
    classify: Literal["pre", "post"]
    #: Post-classified: whether the kernels' sum blurs or passes through the voxels
    interpolate: Union[bool, Literal["off", "on"]]


class VolumeCall(VolumeOptions, total=False):
    """The options of a scene, with the view."""

    camera: Any
    size: Size


class VolumeRender(VolumeOptions, total=False):
    """The options of a picture."""

    size: Size
    transfer: Any


class VolumePictures(VolumeRender, total=False):
    """The options of several pictures, with the camera."""

    camera: Any


class GaussiansOptions(FramedOptions, total=False):
    """The options of ``resample gaussians``."""

    #: Meaning of a Gaussian; all but the volume are twins of other viewers, to compare pictures with
    model: Literal["volume", "khr", "inria", "mip"]
    #: Thickness of the slabs in which Gaussians are summed, by its error: the most that the order inside a slab may change a colour before the slab corrects it, above 0, at most 1
    slab_error: Value
    #: Samples of a pixel
    samples: Literal["auto", "1", "4"]
    #: Stop a ray once its remaining transmittance falls below T (0: never)
    min_transmittance: Value
    #: SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    vector_level: Literal["auto", "avx2", "baseline"]
    #: Planes of an EXR file beside colour and mean depth (Z) [default: none]
    layers: Any
    #: Draw only the inside of a box along the world's axes, from the first corner to the second
    crop: Numbers
    #: Draw only the side of a plane where NX x + NY y + NZ z >= D, in the world; up to six times
    clip_plane: Any


class GaussiansCall(GaussiansOptions, total=False):
    """The options of a scene, with the view."""

    camera: Any
    size: Size


class GaussiansRender(GaussiansOptions, total=False):
    """The options of a picture."""

    size: Size


class GaussiansPictures(GaussiansRender, total=False):
    """The options of several pictures, with the camera."""

    camera: Any


class MeshOptions(FramedOptions, total=False):
    """The options of ``resample texmap``."""

    #: Camera of the file, by name or by number from 0 [default: the whole model, framed]
    camera_name: Value
    #: Animation time at which to pose the model, in seconds [default: the pose of the file]
    pose_time: Value
    #: Animation of --pose-time or --play, by name or by number from 0 [default: the first]
    animation: Value
    #: Advance the animation across the frames of --turntable or --path, from --pose-time, at --fps
    play: bool
    #: Equirectangular picture of the light around the model, .hdr or .exr [default: a neutral studio]
    environment: Value
    #: Pictures of the surfaces
    textures: Literal["shown", "left-out", "grid"]
    #: How texels become pixels
    method: Literal["hybrid", "point", "backward-nearest", "backward-bilinear", "backward-trilinear", "backward-ewa"]
    #: How surfaces are lit
    shade: Literal["auto", "unlit", "headlight", "lambert", "pbr"]
    #: Turn of the surroundings about +y, degrees, counter-clockwise seen from above
    environment_turn: Value
    #: Direction towards the distant light of lambert shading, in the world, of any length
    light: Numbers
    #: Where the mesh casts shadows in the light of the surroundings: nowhere, on itself, or also on a ground that shows nothing else
    shadows: Union[bool, Literal["none", "mesh", "ground"]]
    #: Sub-pixels along a pixel's side at which visibility is decided: 1, 2, 3, 4 or 8
    subpixels: Value
    #: Brightness of the picture, stops: each doubles the light
    exposure: Value
    #: How light beyond what a screen shows is brought into its range
    tone_map: Literal["none", "neutral"]
    #: Planes of the picture beside its colour
    layers: Any
    #: SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    vector_level: Literal["auto", "avx2", "baseline"]


class MeshCall(MeshOptions, total=False):
    """The options of a scene, with the view."""

    camera: Any
    size: Size


class MeshRender(MeshOptions, total=False):
    """The options of a picture."""

    size: Size


class MeshPictures(MeshRender, total=False):
    """The options of several pictures, with the camera."""

    camera: Any


class DepthOptions(SharedOptions, total=False):
    """The options of ``resample warp3d``."""

    #: Also write where the picture has or had holes as a grey PNG or EXR: 1 where nothing was seen
    filled: Value
    #: Also write how well each pixel was seen as a grey PNG or EXR: 0 to 1
    confidence: Value
    #: Most memory to use, such as 4G or 512M; a warp that needs more is refused, with the memory it needs
    max_memory: Value
    #: Camera of the picture: FILE, FILE#ENTRY, fov:DEGREES (the vertical angle of view) or equirectangular [default: the lens of --intrinsics, at the origin]
    from_: Value
    #: New camera: FILE, FILE#ENTRY, or shift:X,Y,Z from the picture's camera (right, down, forward) [default: the picture's own camera, with --stereo, --layout, --quilt or --sway]
    to: Value
    #: Also write the new cameras as a camera file, from which --to draws the same bytes
    save_camera: Value
    #: A further picture, its depth and its camera; may be repeated
    reference: Any
    #: Lens of the picture in pixels, where the camera file holds poses alone: numbers, or a file (Open3D's JSON, a matrix)
    intrinsics: Numbers
    #: Meaning of the depth file's numbers [default: z; relative for a film]
    depth_kind: Literal["z", "ray", "disparity", "inverse", "relative", "mpeg", "opengl"]
    #: World units per stored unit, such as 0.001; needed where distances are stored in whole numbers [default: 1]
    depth_scale: Value
    #: Near plane of an MPEG or OpenGL depth code or of relative depth, world units
    near: Value
    #: Far plane of an MPEG or OpenGL depth code or of relative depth, world units
    far: Value
    #: Stored numbers of relative depth that mean the far and the near plane, such as 0,255; numbers beyond are put there [default: all but 0.5 % of the numbers at each end, of all pictures of a sequence together]
    relative_range: Numbers
    #: A stored number that means "unknown", beside 0, NaN and infinity
    invalid: Value
    #: Stereo baseline for disparity maps, world units [default: that of calib.txt]
    baseline: Value
    #: Difference of the principal points of a disparity, px [default: that of calib.txt, else 0]
    doffs: Value
    #: Two views this far apart (world units), side by side unless --layout says otherwise
    stereo: Value
    #: How views lie in the picture [default with --stereo: side-by-side]
    layout: Literal["side-by-side", "half-side-by-side", "top-bottom", "half-top-bottom", "cross-eye", "colour-and-depth", "equirectangular", "vr180"]
    #: One red-cyan picture of the two views of --stereo
    anaglyph: Union[bool, Literal["dubois", "colour", "grey"]]
    #: Most disparity of the views of --stereo before and behind the screen, per cent of the width: the eyes stand closer together where there is more
    comfort: Value
    #: Black bars at the outer sides of the views of --stereo, as wide as the disparity of the nearest things, so that the frame cuts off nothing that stands before the screen
    floating_window: bool
    #: A grid of COLUMNSxROWS views for light-field screens: the leftmost view at the bottom left, the rightmost at the top right, row by row upwards
    quilt: Size
    #: Angle between the outer views of --quilt, degrees
    view_cone: Value
    #: Distance at which the views of --stereo and --quilt agree and about which --sway turns; `inf` for parallel views [default: the median depth]
    convergence: Value
    #: Sway around the scene, up to this angle from the new camera, once around in N pictures [default: 48]
    sway: Numbers
    #: Pictures over which the depth of things at rest is averaged, scale and offset of each taken out; 0 takes every depth as it is [default: 32 for a sequence whose depth has no unit, else 0]
    steady: Value
    #: Text file of the numbers of the pictures that begin a shot, counted from 0 [default: found in colour and depth]
    cuts: Value
    #: Also draw from the N pictures before and after each one of a sequence whose pictures have cameras of their own
    neighbours: Value
    #: Pictures per second of an animation or of --path [default: 25, or the film's]
    fps: Value
    #: How samples become pixels
    method: Literal["nearest", "points", "splats", "rows", "hybrid"]
    #: How the method nearest keeps hidden samples out [default: zbuffer]
    visibility: Literal["zbuffer", "occlusion-order"]
    #: Filling of holes
    fill: Literal["none", "background", "natural", "film"]
    #: Depth jumps larger than this part of inverse depth separate surfaces [default: from the steps of the depth itself]
    tolerance: Value
    #: Sub-pixels along a pixel's side at depth edges, 1 to 8, of the method hybrid [default: 4]
    subpixels: Value
    #: SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    vector_level: Literal["auto", "avx2", "baseline"]


class DepthCall(DepthOptions, total=False):
    """The options of a scene, with the view."""

    camera: Any
    size: Size


class DepthRender(DepthOptions, total=False):
    """The options of a picture."""

    size: Size


class DepthPictures(DepthRender, total=False):
    """The options of several pictures, with the camera."""

    camera: Any


class PointsOptions(FramedOptions, total=False):
    """The options of ``resample points``."""

    #: Keep at most N points, evenly from the order of the file [default: all]
    points: Value
    #: Also draw points that float far from all others, and those that the grid of a scanner shows to lie between two surfaces or to be crowded
    keep_all: bool
    #: Draw only points inside a box along the world's axes, from the first corner to the second
    crop: Numbers
    #: Draw only points on the side of a plane where NX x + NY y + NZ z >= D, in the world; may be repeated
    clip_plane: Any
    #: Where colours come from
    color_by: Literal["auto", "colour", "height", "intensity", "class", "normal"]
    #: Colour map of heights and intensities [default: viridis for heights, greys for intensities]
    colormap: Value
    #: Heights or intensities at the ends of the colour map [default: those that 2 % of the points lie below and above]
    color_range: Numbers
    #: Axis along which heights are counted, and above which the light of lambert shading stands [default: the one that points up]
    height_axis: Value
    #: How the colours of points become the colour of a pixel
    blend: Literal["mean", "linear"]
    #: How points are lit, by the surface through their neighbours [default: unlit where the colours are the file's, headlight otherwise]
    shade: Literal["unlit", "headlight", "lambert"]
    #: Direction towards the distant light of lambert shading, in the world, of any length [default: aslant from above]
    light: Numbers
    #: Sub-pixels along a pixel's side at outlines: 1, 2, 4 or 8
    subpixels: Value
    #: Draw one point of N, each larger so that surfaces stay closed: quicker and coarser, 1 to 64
    every: Value
    #: Width of a point's Gaussian, spacings of its points: less is sharper and noisier, 0.1 to 1.5
    sigma: Value
    #: How far behind the nearest point of a pixel others still belong to its surface, spacings of the points: 0 to 10
    depth_tolerance: Value
    #: Planes of an EXR file beside colour and depth (Z) [default: none]
    layers: Any


class PointsCall(PointsOptions, total=False):
    """The options of a scene, with the view."""

    camera: Any
    size: Size


class PointsRender(PointsOptions, total=False):
    """The options of a picture."""

    size: Size


class PointsPictures(PointsRender, total=False):
    """The options of several pictures, with the camera."""

    camera: Any
