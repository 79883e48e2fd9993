#include "tests/project/stability_page.h"

namespace tessera {
namespace {

StabilityTopic whole_machine() {
  return {"The whole machine", "",
          {
              {"watertight: static, moving, displaced, defocused", "a closed surface shows the background through a crack", "one grid per base patch, owners of shared edges, exact signs; every sample from inside sees the surface", {"replay: Cases/ClosedSurface.NeverShowsTheBackgroundFromInside", "tilecore: ClosedSurface.MovingAndDefocusedItNeverShowsTheBackgroundWhateverTheMethod", "tilecore: Tessellator.ClosedDisplacedMovingSurfacesHaveNoCrack", "replay: Procedures.NoHoleInAClosedSurfaceOverAContrastingBackground", "replay: ClosedSurfaceTwin.ASurfaceWithMissingTrianglesShowsTheBackground", "tilecore: Tessellator.WithoutOwnersDisplacedEdgesWouldCrack"}},
              {"any tile size, split depth, buffer, coverage, queue level", "binning shows in the picture", "binning decides about work, never about geometry", {"replay: Captures/ShippedCapture.TilesQueuesAndBuffersNeverChangeThePicture", "replay: Captures/ShippedCapture.CoverageTimesAndQueueLevelsNeverChangeThePicture", "replay: Captures/ShippedCapture.BoundingSplittingAndCullingNeverChangeThePicture"}},
              {"any visibility method", "methods disagree about a sample", "one inside test, one form of interpolation", {"replay: Captures/ShippedCapture.EveryVisibilityMethodGivesTheSamePicture"}},
              {"any number of threads and instruction set", "sums in another order, fused operations", "no fused operations but written ones, fixed orders of summation", {"replay: Captures/ShippedCapture.ThreadsAndInstructionSetsChangeNeitherPictureNorCounters", "replay: Captures/ShippedCapture.MethodsTileSizesThreadsAndInstructionSetsTogetherGiveTheSameBits", "tilecore: Tessellator.GivesTheSameBitsOnEveryInstructionSet"}},
              {"an effect forced on that nothing needs", "the general kernel rounds otherwise", "the same bits", {"replay: Captures/ShippedCapture.ForcingTheGeneralKernelsGivesTheSamePicture"}},
              {"the same inputs again", "addresses, time or order of hashing show", "the same bytes", {"replay: ReplayCommand.TheSameInputsGiveTheSameBytes", "replay: Captures/ShippedCapture.FramesAreIndependentOfWhatWasRenderedBefore"}},
              {"the whole scene moved by 10^3 to 10^6 units", "coordinates round by a visible part of a pixel", "nodes and cameras are double precision: at most 0.2 % of pixels show another patch, and colours differ by at most 2e-5 + 1e-9 per unit on average, because shading takes the direction to the eye from world positions in single precision. Vertices are single precision: a scene moved by its *vertices* keeps its picture to about 10^3 times its size, where a coordinate rounds by 1/300 of a pixel, and loses it at 10^6, where it rounds by several", {"replay: By/MovedScene.LooksTheSameWhenItsNodesAreMoved", "replay: MovedVertices.LookTheSameUntilTheyRoundByAVisiblePartOfAPixel"}},
              {"the whole scene scaled by 10^-3 to 10^3", "absolute epsilons", "there are none: by a power of two not a bit changes", {"replay: By/ScaledScene.LooksTheSame", "replay: ScaledScene.ByAPowerOfTwoLooksTheSameBitByBit", "replay: ScaledScene.WithALensOfTheOldSizeIsCaught"}},
              {"the camera comes closer", "pops where a tessellation factor changes", "no step of a tenth of a pixel changes the picture by more than twice the median step", {"replay: Continuity.NothingPopsAsTheCameraComesCloser", "replay: Continuity.CoarseTessellationThatPopsIsCaught", "replay: Continuity.TheTargetEdgeChangesThePictureGradually"}},
              {"a split level changes", "pops where a sub-patch is halved", "splits change nothing at all", {"replay: Continuity.SplitLevelsDoNotShow"}},
              {"time passes, the shutter opens, the lens opens", "a jump where an effect begins to be needed", "kernels with and without an effect agree where it vanishes", {"replay: Continuity.ALittleLaterIsALittleDifferent", "replay: Continuity.AShutterThatOpensALittleBlursALittle", "replay: Continuity.ALensThatOpensALittleDefocusesALittle"}},
              {"a threshold changes a little", "all blocks change their regime at once", "block by block", {"replay: Continuity.ThresholdsOfTheResolveUnitChangeBlocksOneByOne"}},
          }};
}

StabilityTopic traps() {
  return {"Floating-point traps",
          "These units promise in their headers to raise neither the invalid nor the divide-by-zero flag for finite input; the tests run them with traps for both. No such promise is made by what makes infinities on purpose (a ray's slabs, bounds by intervals) and by vector kernels (tessellation, boxes, visibility), which compute every lane and choose afterwards.",
          {
              {"bounds of the hardest patches", "0/0 on the way to a bound that looks right", "lengths are compared before they divide", {"tilecore: HardCase/Traps.BoundsRaiseNothing"}},
              {"splitting, culling, coverage of tiles", "the same", "the same", {"tilecore: HardCase/Traps.TheFrontEndAndTheCoverageOfTilesRaiseNothing"}},
              {"boxes that stand still or nearly", "t = d0 / (d0 - d1)", "solved only where the signs differ", {"tilecore: Traps.TheBundleFrustumRaisesNothingForRandomStillAndSlowBoxes"}},
              {"degenerate triangles", "division by the area", "signs first", {"tilecore: Traps.TheInsideTestRaisesNothingForDegenerateTriangles"}},
              {"twin", "traps that are never armed", "a division by zero and an invalid operation end the program", {"tilecore: TrapsDeathTest.ADivisionByZeroAndAnInvalidOperationAreCaught"}},
          }};
}

StabilityTopic input() {
  return {"Input from outside",
          "Fuzzers begin with inputs made by code from the shipped captures and the corpus of broken ones, change them with their form kept (a .glb's lengths, a PNG's checksums, a JSON's syntax), and run with the sanitizers, a limit on memory and a limit on time.",
          {
              {"any bytes as a capture", "crash, hang, leak, reads beyond a buffer, numbers that are not finite", "every index, range, count and URI is checked before use; one line says where and what", {"frontend: EachClass/BrokenCaptures.AreRefusedInOneLineThatNamesFilePlaceAndFault", "frontend: GltfContainer.RefusesEveryTruncatedLength", "fuzz: capture"}},
              {"any capture that loads", "values that pass the reader and break the machine", "rendered under the sanitizers", {"fuzz: replay"}},
              {"any bytes as a Draco stream", "counts that the decoder allocates by", "the head is read and charged first", {"frontend: DracoStream.IsSoundOrRefusedAtEveryTruncatedLength", "frontend: DracoStream.IsSoundOrRefusedWhicheverByteIsWrong", "fuzz: draco"}},
              {"any bytes as a picture", "decompression bombs, sizes that overflow", "containers are walked and sizes charged before pixels are allocated", {"base: ImageCodec.EveryTruncatedPngIsRefused", "base: ImageCodec.SizesBeyondTheLimitsAreRefusedBeforePixelsAreAllocated", "base: JpegDecoder.APictureBeyondTheLimitsIsRefusedBeforeAnythingIsAllocated", "base: ExrFile.SizesBeyondTheLimitsAreRefusedBeforePixelsAreAllocated", "fuzz: picture", "fuzz: exr"}},
              {"a JPEG that names tables it has not, or tables that do not fit", "a decoder reads outside of its tables, or makes pixels up", "libjpeg-turbo, whose warnings are refusals", {"base: JpegDecoder.TablesThatAreMissingOrDoNotFitAreRefused", "base: JpegDecoder.WhatTheLibraryWouldOnlyWarnOfIsRefused", "base: JpegDecoder.EveryTruncatedFileIsRefused", "base: JpegDecoder.FourChannelsAreRefused"}},
              {"any bytes as a history", "a head that promises more than the file has", "the length must be the head's before memory is taken", {"replay: History.DamagedFilesAreRefusedAtEveryLength", "fuzz: history"}},
              {"any bytes as a study, a machine, an option, results", "numbers beyond their ranges, ranges of endless steps, members of another type", "key tables; points are counted before they are made", {"replay: Study.FaultsAreNamedByTheirPlaceWithTheNearestKnownName", "replay: Study.MorePointsThanAllowedAreRefusedBeforeTheyAreMade", "hardware: Configuration.FaultsInAFileNameTheNearestKey", "replay: CompareCommand.DamagedStatisticsEndWithStatus3", "replay: TradeoffReport.AResultThatLacksWhatThePageShowsEndsWithStatus3", "fuzz: study", "fuzz: machine", "fuzz: option", "fuzz: result"}},
              {"more memory than allowed", "a small file that unpacks to much", "charged before it is allocated, refused at the byte", {"frontend: MemoryBudget.ChargesAtLeastWhatReadingHasOnTheHeapAtOnce", "frontend: MemoryBudget.SufficesExactlyAndRefusesOneByteBelow", "frontend: MemoryBudget.RefusesWhatUnpacksToMoreBeforeUnpackingIt", "replay: ReplayCommand.PicturesBeyondTheMemoryLimitEndWithStatus4"}},
              {"URIs that leave the capture's folder", "any file of the machine is read", "links resolved, then compared; no network", {"frontend: ResolveUri.NeverNamesAFileOutsideTheFolder"}},
          }};
}

StabilityTopic long_runs() {
  return {"Long runs", "",
          {
              {"killed at any moment", "half a file that looks whole", "temporary names, renamed when complete; a second run goes on and gives the same bytes", {"replay: Sweep.KilledAndStartedAgainGivesTheSameBytes", "replay: Sweep.WhatAKilledRunLeftHalfWrittenIsRemoved"}},
              {"Ctrl-C", "the frame in hand is lost", "it is finished, statistics are complete", {"replay: ReplayCommand.CtrlCFinishesTheFrameInHandAndWritesItsStatistics", "replay: Sweep.CtrlCFinishesThePointsInHandAndTheNextRunGoesOn"}},
              {"disk full", "a truncated file under the final name", "reported, the partial file removed", {"base: AtomicFile.AWriteThatFailsHalfWayIsReportedAndLeavesNothing", "replay: ReplayCommand.AFolderThatCannotBeWrittenIsReportedAndNothingIsLeftBehind"}},
              {"a hundred and twenty frames from history", "errors that add up", "they do not grow", {"replay: Desampling.ErrorsOfAdvectionDoNotGrowOver120Frames"}},
          }};
}

StabilityTopic accuracy() {
  return {"Accuracy against cost", "`tessera tradeoff` compares with a reference in double precision; what it says is worth no more than that.",
          {
              {"a reference that errs as the machine does", "errors cancel, a setting looks perfect", "another renderer: rays in double precision through triangles at each sample's own time, plain random numbers; where there is a formula, against it", {"replay: Reference.CoverageOfAMovingEdgeIsTheMeanOverPixelAndShutter", "replay: Reference.CoverageOfADefocusedEdgeIsThatOfTheLensDisc", "replay: Reference.WithTheMachinesSamplesDiffersByItsArithmeticAlone"}},
              {"a reference that has not converged", "its own noise is taken for the machine's error", "noise is measured from its halves and said beside the result; it falls with the root of the samples", {"replay: Reference.ErrorFallsWithTheRootOfTheSamples", "replay: Reference.IsWhereTheMachineGoesWithMoreSamples"}},
              {"triangles that move fast through the reference's tree", "a box at one time misses them at another", "boxes move with them", {"replay: ReferenceTree.BoxesHoldTheirTrianglesAtEveryTime", "replay: ReferenceTree.FindsWhatAllTrianglesOneByOneGive"}},
              {"equal points, points equal in one of two", "two that are alike push each other off the front", "beaten means no worse in both and better in one", {"replay: ParetoFront.IsWhatNoOtherPointBeats"}},
              {"what has no cycles, errors of zero", "a run in double is the cheapest machine; infinite decibels are no JSON", "left out of what is cheapest; null, shown as equal", {"replay: Cheapest.IsTheLeastCostAmongThoseGoodEnough", "replay: Words.SayWhatASettingCostsAndSaves"}},
              {"knobs without effect on this capture", "hours of equal pictures", "left out, with the reason", {"replay: Knobs.AreLeftOutWhereTheyChangeNothing", "replay: Knobs.CompareWithTheDefaults"}},
              {"two knobs that set one key, too many combinations", "the second wins silently; endless runs", "refused before the combinations are run", {"replay: TradeoffCommand.TurnsKnobsTogether"}},
              {"started again with a result missing", "everything anew, or results of another scene", "results are named by what they follow from; only what is missing is run", {"replay: TradeoffCommand.DoesNotRunAgainWhatIsThere", "replay: TradeoffCommand.FollowsFromItsInputsButForTimes"}},
          }};
}

}  // namespace

std::vector<StabilityTopic> whole_cases() { return {whole_machine(), traps(), accuracy(), input(), long_runs()}; }

}  // namespace tessera
