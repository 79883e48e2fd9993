#include "tests/project/stability_page.h"

namespace tessera {
namespace {

#define BOUNDS_OF(kind) "frontend: HardCase/SubPatchBounds.HoldEveryPointOfTheDisplacedMovingDefocusedPatch/" kind "_"

StabilityTopic bounds() {
  return {"Bounds of patches",
          "Each kind of patch below is displaced, moved and defocused at random and bounded by all five methods; points of the surface in double precision and the vertices that the machine computes must lie inside. Twins: bounds without "
          "displacement, without motion, without the vertices of neighbours, with the published sign of a cosine.",
          {
              {"pole, collapsed edge", "a control vector of length zero has no direction; the normal at the pole is the limit of its neighbours", "zero vectors give no cone: the normal may point anywhere; the domain shader takes the limit from inside",
               {BOUNDS_OF("Pole"), "frontend: NormalCones.DegenerateNetsHaveNone", "shaders_cpp: Bicubic.AtAPoleTheNormalIsTheLimitFromInside"}},
              {"all control points equal", "0/0 in the axes of the box and in the normal", "axes of the object; a fixed finite normal", {BOUNDS_OF("AllPointsEqual"), "shaders_cpp: Bicubic.APatchThatIsOnePointHasAFiniteNormal"}},
              {"folded patch, normal flips", "a cone around the mean normal leaves out the fold", "cones must not overlap their mirror images, else any normal", {BOUNDS_OF("Folded"), "frontend: Npatch.ContainsEveryNormalAndIsNeverLooserThanTpatch"}},
              {"tangents nearly parallel, or open beyond 90 degrees", "the published cone is too narrow: the cosine between tangents enters with its sign", "its magnitude enters; every cosine is widened by its rounding",
               {BOUNDS_OF("NearlyParallelTangents"), "frontend: Tpatch.ContainsNormalsAlsoWhenTangentsOpenBeyondNinetyDegrees", "frontend: Tpatch.ThePublishedSignOfTheCosineIsCaught"}},
              {"huge coordinates (10^6)", "rounding grows with the coordinate, not with the patch", "boxes grow by a bound of the rounding of every operation, in units of the largest coordinate", {BOUNDS_OF("HugeCoordinates")}},
              {"tiny coordinates (10^-6)", "lengths underflow, lengths below a fixed epsilon are taken for zero", "no absolute epsilons; gradual underflow stays on", {BOUNDS_OF("TinyCoordinates"), "shaders_cpp: Bicubic.NormalsAreRightFromTinyToHugePatches"}},
              {"tiny patch far from the origin", "control points cancel; what is left is rounding", "derivatives carry the error of the differences that they are", {BOUNDS_OF("FarFromTheOrigin")}},
              {"displacement larger than the patch, negative scale", "low and high ends of the product change places", "all four products of the two intervals", {BOUNDS_OF("DisplacementLargerThanThePatch"), "frontend: SubPatchBoundsTwin.ABoundThatForgetsDisplacementIsCaught"}},
              {"texture footprint that wraps around", "the range of the texture's inside instead of that of its two ends", "footprints are wrapped texel by texel, the filter's own texels included", {"frontend: MinMaxPyramid.HoldsEveryFilteredValueOfAFootprintAtAnyLevelAndWrap", "frontend: MinMaxPyramid.AQueryThatForgetsTheFiltersFootprintIsCaught"}},
              {"footprint of one texel, of the whole texture", "an empty or an endless range of texels", "levels are chosen by the footprint; the top level is the whole", {"frontend: MinMaxPyramid.OneTexelIsItsOwnRangeEverywhere", "frontend: MinMaxPyramid.TheWholeTextureAndFootprintsAcrossItsEdgesAreHeld", BOUNDS_OF("FlatTexture")}},
              {"patch crosses the camera plane at one key, both, or only between them", "division by a w that is zero or negative; motion on screen is not linear", "all segments between the sixteen corners are cut at the near plane; what is not safe covers the screen",
               {BOUNDS_OF("CrossingTheCameraPlane"), "frontend: ScreenBounds.HoldEveryMovingDefocusedPointAlsoAcrossTheCameraPlane", "frontend: ScreenBounds.BoxesThatMoveLinearlyOnScreenAreCaught"}},
              {"camera inside the box", "no side of the box is a bound of its picture", "as above", {BOUNDS_OF("CameraInside")}},
              {"motion exactly zero", "an interval of time from 0/0", "what does not move has all times", {BOUNDS_OF("NoMotion"), "binner: TimeIntervals.WhatDoesNotMoveHasAllTimes"}},
              {"opposite motion at two corners", "a rigid box fits neither key", "one frame for both keys, extents for each", {BOUNDS_OF("OppositeMotionAtTwoCorners")}},
              {"motion larger than the screen", "times between the keys at which nothing is on screen are lost", "the hull over the shutter, cut by the tiles", {BOUNDS_OF("MotionLargerThanTheScreen")}},
              {"focus distance inside the box, aperture zero", "the circle of confusion is smallest inside, not at an end", "the larger of the two ends' circles", {"frontend: ScreenBounds.AFocusDistanceInsideTheBoxGrowsByItsFartherEnd", "frontend: ScreenBounds.BoundsThatForgetTheLensAreCaught", "tilecore: VisibilityMethods.ALensOfRadius0IsAPinholeBitByBit"}},
              {"matrix without an inverse (scale 0)", "normals from an inverse that is not there", "normals follow from tangents", {BOUNDS_OF("ZeroScale"), "replay: OddFrames.DegenerateTransformsAndPatchesDrawNothingAndBreakNothing"}},
              {"back faces of displaced patches", "a patch that is culled and of which a bump is seen", "normals of the displaced surface bounded by the slopes of the texture", {"frontend: Case/BackFaceCulling.DropsNoTriangleThatCouldFaceTheCamera", "frontend: BackFaceCullingTwin.BelievingTheMiddleOfASubPatchIsCaught"}},
          }};
}

StabilityTopic binning() {
  return {"Binning", "",
          {
              {"bounds that end exactly on a tile's edge", "the sample on the edge belongs to a tile that does not know the patch", "closed on both sides: assigned to both", {"binner: TileGrid.BoundsThatEndOnATilesEdgeBelongToBothTiles", "binner: ExactCoverage.BoundsThatEndOnATilesEdgeBelongToBothTiles", "binner: ExactCoverage.ATileTouchedInItsCornerOnlyIsCoveredAndOneAHairAwayIsNot"}},
              {"off screen on any side", "negative tile numbers wrap", "clamped in double precision before they become integers", {"binner: HardCases.OffScreenOnAnySideGivesNoEntryAtAnyLevel", "binner: TileGrid.BoundsOutsideOnAnySideCoverNothingAndHugeOnesEverything"}},
              {"frames of one pixel and of no multiple of a tile", "pixels of the last tile outside of the frame", "tiles are cut by the frame", {"binner: HardCases.FramesOfOnePixelAndOfNoMultipleOfATile", "replay: OddFrames.OnePixelAndSizesThatNoTileDividesWork"}},
              {"more than 65 535 tiles, a patch in every tile", "a 16-bit tile number wraps", "32 bits; queues of 2x2, 4x4 ... tiles", {"binner: TileGrid.MoreThan65535TilesAreNumberedRight", "binner: HardCases.APatchInEveryTileOfMoreThan65535", "binner: Binner.ASubPatchOverTheWholeFrameIsInEveryTile"}},
              {"zero patches", "empty ranges", "empty queues cost their heads only", {"binner: Binner.NoSubPatchesGiveEmptyQueues", "replay: OddFrames.AnEmptySceneIsAllBackground"}},
              {"chunk larger than the buffer", "a buffer that can never take an entry: an endless loop of partial renders", "refused with the numbers before the frame", {"binner: ParameterBuffer.OneThatCannotHoldAChunkIsRefusedWithTheNumbers", "binner: HardCases.ListHeadsOfAllLevelsMustFitAndExactlyEnoughSuffices"}},
              {"a field of an entry overflows", "a wrapped patch number shows another patch", "every field is checked when packed: a broken invariant, never a wrap", {"binner: QueueEntry.ARangeThatDoesNotFitIsABrokenInvariantNotAWrap", "binner: QueueEntry.ExtremeDepthsStayOrdered"}},
              {"buffer of exactly the needed size", "off by one: refuses the last or writes beyond", "full means the next does not fit", {"binner: ParameterBuffer.ABufferOfExactlyTheNeededSizeSuffices", "binner: ParameterBuffer.P1FullItRefusesAndWhatWasAcceptedIsStillThere"}},
              {"buffer full in the middle of a frame", "entries are lost, blended layers change their order", "partial render or spill; the picture is the same", {"replay: PartialRender.IsCountedAndLosesNothing", "binner: HardCases.LevelsOfQueuesAndPartialRendersGiveEveryTileItsSubPatchesOnce"}},
              {"a deforming box that turns", "corners that move on their own lines miss vertices between", "least and greatest over corners at each key, joined by a line", {"binner: TimeIntervals.HoldEveryTimeAtWhichTheMovingBoxTouchesTheTile", "binner: TimeIntervalsTwin.CornersThatMoveOnTheirOwnLinesMissADeformingBoxThatTurns", "binner: TimeIntervalsTwin.LinearMotionOnScreenNoLensOrNoMotionIsCaught"}},
              {"NaN and bodies across the near plane", "comparisons with NaN drop the tile", "comparisons are written so that NaN keeps", {"binner: ExactCoverage.BodiesThatCrossTheNearPlaneAndNaNKeepTheRectangleAndAllTimes", "frontend: ScreenBounds.PointsThatAreNotFiniteKeepTheBodyEverywhere"}},
          }};
}

StabilityTopic visibility() {
  return {"Visibility", "Hits are compared with exact arithmetic in double precision, with Embree, and with each other's methods.",
          {
              {"ray parallel to a slab", "0 * infinity is NaN and the box is missed", "what is NaN does not narrow the interval", {"tilecore: MotionBvh.RaysParallelToASlabMeetWhatTheyAreInside"}},
              {"hit exactly on a shared edge or vertex, at t=0 and t=1", "both triangles claim the sample, or none", "exact signs, ties by a symbolic shift of the sample", {"tilecore: HardCases.SamplesOnSharedEdgesAndVerticesAreHitOnceAtEveryTime", "tilecore: HardCases.SamplesOnSharedEdgesAndVerticesAreHitOnceAtShutterOpenAndAtTheLastTime", "tilecore: HardCases.ASheetWithoutOneCellIsCaughtByTheCount", "tilecore: TriangleTest.ANaiveClosedTestCountsSharedEdgesTwiceAndIsCaught"}},
              {"triangle that is degenerate at one time only", "division by an area of zero", "an area of zero holds nothing; depth is solved after the signs", {"tilecore: HardCases.ATriangleThatIsDegenerateAtOneTimeOnlyHoldsNothingThenAndIsExactBeforeAndAfter", "tilecore: TriangleTest.DegenerateTrianglesHoldNothing", "tilecore: VisibilityMethods.AgreeOnTrianglesThatDegenerateOrFlipWithinTheShutter"}},
              {"triangle that turns edge-on or flips within the shutter", "facing of one key decides for all times", "facing is the sign at the sample's own time", {"tilecore: HardCases.TrianglesThatTurnEdgeOnOrFlipWithinTheShutterAreExactAndShowTheSideTheyHaveThen"}},
              {"patch that passes through the camera plane", "vertices with w <= 0 are projected", "cells with such a vertex are tested in homogeneous coordinates", {"tilecore: CameraPlane.AWallThatPassesThroughItIsSeenExactlyUntilItReachesTheNearPlane", "tilecore: ClippedCells.AFloorThatPassesUnderTheCameraHasNoHole"}},
              {"motion of whole screens", "fixed-point coordinates overflow", "positions in single precision with a guard band, exact signs in double", {"tilecore: HardCases.MotionOfWholeScreensIsExact"}},
              {"all samples at one time", "time intervals of no length", "closed intervals of codes", {"tilecore: VisibilityMethods.AgreeWhenAllSamplesHaveOneTime"}},
              {"lens of radius 0", "another path for a pinhole with other rounding", "equal bit by bit", {"tilecore: VisibilityMethods.ALensOfRadius0IsAPinholeBitByBit", "tilecore: RayPath.WithoutMotionAndWithALensOfRadiusZeroItEqualsTheRasterPathBitByBit"}},
              {"focus at infinity", "1/f of an infinite f", "the inverse is what is kept", {"tilecore: HardCases.FocusAtInfinityIsExact"}},
              {"hits at the near and the far plane", "open or closed by chance", "closed, in every method", {"tilecore: HardCases.HitsAtTheNearAndTheFarPlaneAreExact"}},
              {"a million units from the origin", "single precision leaves sixteenths of a unit", "matrices are multiplied in double; raster space is near the camera", {"tilecore: HardCases.AMillionUnitsAwayAtTheEndOfTheGuardBandIsExact", "tilecore: VisibilityMethods.AgreeAtTheEndOfTheGuardBandAndAMillionUnitsAway", "replay: OddFrames.CoordinatesUpToAMillionKeepTheirPicture"}},
              {"two coplanar patches", "the order of arrival shows", "the lower number wins", {"tilecore: CoplanarPatches.WhereTwoMoveTogetherTheLowerNumberIsSeenWhateverTheOrderAndMethod", "tilecore: TileCore.CoplanarSurfacesShowTheLowerNumberedPatch"}},
              {"tile with no entry, with one sample, with 10^5 entries", "empty loops, masks of one bit, tables that fill", "no fixed capacities on the host; the machine's own overflow is counted", {"tilecore: TileCore.ATileWithoutEntriesShowsTheBackground", "tilecore: TileCore.TilesOfOneSampleSeeWhatOneTileSees", "tilecore: VisibilityMethods.AgreeOnATileWithOneSample", "tilecore: TileCore.AHundredThousandEntriesOfOneCellAreTheFewPatchesThatTheyAreCutFrom"}},
              {"slow motion against the side of a tile", "the time of entry solved in floats lies behind the true one in half of the cases", "distances move inwards by their error before the crossing is solved", {"tilecore: TouchingTimes.NeverMissATimeAtWhichTheBoxTouchesHoweverSlowTheMotion", "tilecore: TouchingTimes.ANaiveSolveIsCaught", "tilecore: BundleFrustum.ANaiveSolveInSinglePrecisionIsCaught"}},
              {"a lens in front of a tile", "a side of the tile is no half-space", "two planes a side, through the extremes of the lens; outside of both", {"tilecore: BundleFrustum.NeverDropsABoxNorATimeAtWhichARayMeetsIt", "tilecore: BundleFrustum.OnePlanePerSideThroughTheMiddleOfTheLensIsCaught"}},
              {"stencil value 0 and 255", "a sample that no segment keeps, or two do", "half-open segments, the last closed", {"tilecore: StencilUnit.SegmentsKeepEveryValueExactlyOnceStencil0AndStencil255Included", "tilecore: StencilUnit.AHalfOpenLastSegmentIsCaughtLosingTheLastValue"}},
              {"more blended layers than there is room for", "layers are dropped, or the order of arrival shows", "the farthest are merged and counted, in an order of depth", {"tilecore: LayerMerger.NothingIsDropped", "tilecore: LayerMerger.TheOrderOfArrivalDoesNotMatter", "tilecore: Blending.OverflowsMergeAndAreCounted"}},
          }};
}

}  // namespace

std::vector<StabilityTopic> geometry_cases() { return {bounds(), binning(), visibility()}; }

}  // namespace tessera
