#include "tests/project/stability_page.h"

namespace tessera {
namespace {

StabilityTopic procedures() {
  return {"Procedural surfaces", "",
          {
              {"degenerate parameters: a pole, a radius of zero", "no normal, no size", "normals borrow their neighbours'; a point or nothing is drawn", {"tilecore: HardProcedures.ASurfaceOfNoSizeIsAPointOrNothing", "shaders_cpp: Normals.APoleHasNoneOfItsOwnAndBorrowsItsNeighbours"}},
              {"step size zero or infinite", "an endless loop over a cell, or a cell without a sample", "steps are 1 to 128 a cell, whatever the rate; what is clamped is counted", {"tilecore: HardProcedures.ARateOfZeroOrWithoutBoundStaysWithinTheStepsOfACell", "tilecore: HardProcedures.ValuesThatAreNotFiniteAreCountedAndSkipped"}},
              {"surface seen edge-on", "footprints without area", "a sample reaches what lies within half a step", {"tilecore: HardProcedures.EdgeOnThereIsHardlyAnythingToSee"}},
              {"object behind the camera, or across it", "division by a w that is not positive", "dropped before the division; the cell is unknown, not outside", {"tilecore: HardProcedures.BehindTheCameraCostsNoSamples", "tilecore: HardProcedures.AFloorThatStraddlesTheCameraReachesTheFrontOfThePicture"}},
              {"object in one pixel, object over all tiles", "thin things slip through the sparse pass", "cells are bounded by intervals, not by samples", {"tilecore: HardProcedures.AnObjectInOnePixelIsSeen", "tilecore: HardProcedures.AnObjectOverAllTilesWithTheCameraInsideLeavesNoSampleOut", "tilecore: ParameterMaps.IntervalsMissNothingInRandomScenes", "tilecore: ParameterMaps.ThePublishedOnesMissWhatLiesBetweenTheirTuples"}},
              {"values that are not finite", "NaN in the depth buffer wins or loses every comparison", "counted and skipped", {"tilecore: HardProcedures.ValuesThatAreNotFiniteAreCountedAndSkipped"}},
              {"closed parameters, chains of curves", "a seam where u = 0 meets u = 1", "turns are computed from the same number on both sides", {"shaders_cpp: Shapes.ClosedParametersMeetBitForBit", "shaders_cpp: Shapes.PiecesOfAChainMeetBitForBit"}},
              {"equal depths", "the order of scattering shows", "the lower patch wins", {"tilecore: SamplingController.EqualDepthsGoToTheLowerPatchWhateverComesFirst"}},
              {"drawn with lines, the surface beneath", "strokes change what they do not cover", "the surface is sampled as ever; strokes lie in front of it", {"tilecore: Lines.WhatTheyLeaveFreeIsTheSurfaceBitByBitAndStrokesLieInFrontOfIt"}},
              {"drawn with lines, a stroke across a tile's border", "the tile beyond does not know of it", "tiles also list cells whose strokes alone reach them", {"tilecore: Lines.FollowFromTheSceneAloneWhateverTheTiles"}},
              {"noise across the lines of its lattice", "an interval that ends on a line misses the next cell", "every cell that the interval touches is joined", {"frontend: ProcedureEnclosure.NoiseStaysInItsRangeAcrossLatticeLines", "frontend: ProcedureEnclosure.ANarrowerOneIsCaught"}},
          }};
}

StabilityTopic effects() {
  return {"Effects that a scene can do without", "Motion, lens, displacement and alpha test are left out where bounds show that nothing of them is seen: the picture is the same, bit by bit, when they are forced everywhere.",
          {
              {"motion by less than a sub-pixel, a lens nearly in focus", "one tile leaves the effect out and its neighbour does not: a seam", "one rule for each vertex, whoever asks; bounds only tell beforehand that all vertices obey it", {"effects: SubPatchEffects.E1AndE2HoldForEverySubPatchThatGoesWithoutMotionOrLens", "effects: Effects.AnObjectThatMovesByLessThanASubPixelNeedsNoCodeForMotion", "effects: Effects.EveryVisibilityMethodElidesThemWithoutAChange"}},
              {"thresholds that are a little too wide", "what moves stands still", "found by tessellating what was left out", {"effects: SubPatchEffects.AnElisionThatLeavesOutTooMuchBreaksE1AndE2", "effects: Effects.AMovingSubPatchThatRanWithoutMotionWouldBeNoticed"}},
              {"camera and object that move alike, camera that moves alone", "motion in the world is taken for motion on screen", "decided from the screen at both keys", {"effects: Effects.ACameraThatMovesAloneMovesEverythingThatItSees"}},
              {"cut inside the shutter, cut between two frames", "a step in an animation is missed between its keys", "posed at both keys of the frame itself", {"effects: Effects.ACutBetweenTwoFramesIsNoMotionAndOneInsideTheShutterIs"}},
              {"surface that the plane of focus crosses", "in focus somewhere is taken for in focus all over", "both ends of its depths are looked at; a wall that is tilted is blurred, one straight on is not", {"effects: Effects.OnlyWhatIsInFocusAllOverNeedsNoCodeForTheLens"}},
              {"map that is zero here and not there", "vertices that a neighbour owns open a crack", "displaced unless the offset is zero at all vertices, those of neighbours included; a constant moves all", {"effects: SubPatchEffects.E3SubPatchesWithoutDisplacementHaveTheSameVerticesWithAndWithoutIt", "effects: Effects.AMapThatIsZeroReadsNoHeights"}},
              {"alpha near the cutoff between texels", "a hole that filtering makes is drawn shut", "least alpha over all texels that a sub-patch's look-ups may touch", {"effects: SubPatchEffects.E4NoPointOfASubPatchWithoutAlphaTestIsBelowTheCutoff", "effects: Effects.OpaquePartsOfAMaskedMaterialAreNotTested"}},
              {"an effect forced off", "something of it stays", "the picture of the capture without it", {"effects: Effects.ForcedOffTheyGiveThePictureOfTheCaptureWithoutThem", "effects: Effects.ForcedOnEverywhereTheyGiveTheSamePicture"}},
          }};
}

StabilityTopic resolve() {
  return {"Resolve: desampling, advection, reconstruction", "",
          {
              {"first frame, no history", "memory of nobody's frame is shown", "nothing is advected", {"replay: Desampling.TheFirstFrameAFrameAfterAGapAndAChangedLightHaveNoHistory"}},
              {"cut: the camera jumps", "ghosts of the old view", "depth and surface must agree, else the pixel is shaded", {"replay: Desampling.ACutTakesNothingOverThatIsNotThere"}},
              {"object enters or leaves the frame", "trails", "as above, and discrepancy bits", {"replay: Desampling.ObjectsEnterAndLeaveTheFrameWithoutTrails"}},
              {"motion vector that points outside of the frame", "reads beyond the history, floats that no integer holds", "refused before the conversion", {"tilecore: Advection.APlaceOutsideOfTheFrameIsRefusedHoweverFar", "tilecore: Advection.UnusableAndNonFiniteVelocitiesAreRefused"}},
              {"speed exactly at a threshold", "the regime flickers from frame to frame", "hysteresis", {"tilecore: RateSelector.ASpeedAtAThresholdDoesNotFlicker"}},
              {"depth at the far and at the near plane", "a threshold in units of depth sees edges everywhere or nowhere", "Laplacian of 1/z relative to it: no edge on any plane, at any scale", {"tilecore: EdgeDetector.InverseDepthSeesNoEdgeOnAnyPlaneAndDepthSeesOneOnSteepPlanes", "tilecore: EdgeDetector.AStepIsAnEdgeAtAnyDepthAndAnyScale", "tilecore: EdgeDetector.NothingBesideSomethingIsAnEdgeAndNothingAloneIsNone"}},
              {"blocks at a frame's edge that is no multiple of 4", "pixels outside of the frame count", "blocks are cut", {"tilecore: EdgeDetector.BlocksCutByTheFrameLookAtWhatTheyHave", "replay: Desampling.FramesAndRegionsThatCutBlocksAreWhole", "tilecore: StencilTables.EveryMissingPixelOfEveryPatternAtEveryBorderHasAStencil"}},
              {"fireflies and NaN in colour", "negative lobes turn light negative; NaN spreads from frame to frame", "not finite is not usable; results may be clamped to their window", {"replay: Desampling.ColoursThatAreNotFiniteStayWhereTheShaderMadeThem", "tilecore: CubicStencil.NonFiniteNeighboursAreAsIfNotUsable", "tilecore: CubicStencil.BesideAFireflyOnlyTheClampKeepsLightFromTurningNegative"}},
              {"mask with no rendered pixel nearby", "0/0", "reported, and the pixel is shaded", {"tilecore: CubicStencil.AWindowWithNothingUsableIsReportedAndNothingIsWritten"}},
              {"negative lobes that eat the sum of weights", "division by nearly nothing", "the denominator is bounded; nearest pixels stand in", {"tilecore: CubicStencil.WhereNegativeLobesEatTheSumTheNearestPixelsStandIn", "tilecore: StencilTables.RoundingBeforeNormalisingLosesStencils"}},
              {"a flat colour", "weights that sum to almost one", "quantised after normalisation, to a sum that is a power of two", {"tilecore: CubicStencil.AFlatColourComesBackToOneUnitInTheLastPlace", "tilecore: CubicStencil.AFlatColourUnderThePatternsIsExactToAUnitAndAPlainQuotientIsNot"}},
              {"standing still", "a copy that blurs a little each frame", "zero velocity copies bit for bit", {"tilecore: Advection.StandingStillIsACopyBitForBit", "replay: Desampling.ErrorsOfAdvectionDoNotGrowOver120Frames"}},
              {"points behind the eye in either frame", "velocity from a w that is not positive", "not usable", {"tilecore: MotionField.PointsBehindTheEyeInEitherFrameAreNotUsable"}},
              {"a history of any content", "a damaged history shows for ever", "recovers within a period of the dither", {"replay: Desampling.AStaticSceneRecoversFromAnyHistoryWithinTheCountersPeriod", "replay: History.DamagedFilesAreRefusedAtEveryLength"}},
          }};
}

}  // namespace

std::vector<StabilityTopic> picture_cases() { return {procedures(), effects(), resolve()}; }

}  // namespace tessera
