// Tracks of an eye, from CSV files.
#include "gpu/focus_track.h"
#include "base/error.h"
#include "tests/support/tests.h"

namespace tessera::gpu::focus_track_test {
namespace {

std::string fault_of(const std::string& text) {
  try {
    FocusTrack::parse(text, "eye.csv");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(FocusTrack, GoesStraightBetweenItsLinesAndRestsBeforeAndAfterThem) {
  for (const char* text :
       {"time,x,y\n0.5,0.25,0.5\n1.5,0.75,0.1\n2,-0.5,1\n", "0.5,0.25,0.5\r\n 1.5 , 0.75,\t0.1\r\n2,-0.5,1"}) {
    const FocusTrack track = FocusTrack::parse(text, "eye.csv");
    EXPECT_EQ(track.size(), 3u);
    EXPECT_EQ(track.at(-7), DVec2(0.25, 0.5));
    EXPECT_EQ(track.at(0.5), DVec2(0.25, 0.5));
    EXPECT_DOUBLE_EQ(track.at(0.75).x, 0.375);
    EXPECT_DOUBLE_EQ(track.at(0.75).y, 0.4);
    EXPECT_DOUBLE_EQ(track.at(1.75).x, 0.125);
    EXPECT_EQ(track.at(2), DVec2(-0.5, 1));
    EXPECT_EQ(track.at(1e9), DVec2(-0.5, 1));
  }
}

TEST(FocusTrack, FaultsNameFileAndLine) {
  EXPECT_THAT(fault_of("time,x,y\n0,0.5,0.5\n1,0.5\n"), HasSubstr("eye.csv"));
  EXPECT_THAT(fault_of("time,x,y\n0,0.5,0.5\n1,0.5\n"), HasSubstr("line 3"));
  EXPECT_THAT(fault_of("0,0.5,0.5\n1,0.5,0.5,0.5\n"), HasSubstr("line 2"));
  EXPECT_THAT(fault_of("0,0.5,0.5\n\n1,0.5,0.5\n"), HasSubstr("line 2"));
  EXPECT_THAT(fault_of("0,0.5,left\n"), HasSubstr("'left' is not a number"));
  EXPECT_THAT(fault_of("0,nan,0\n"), HasSubstr("line 1"));
  EXPECT_THAT(fault_of("0,inf,0\n"), HasSubstr("line 1"));
  EXPECT_THAT(fault_of("0,11,0\n"), HasSubstr("from -10 to 10"));
  EXPECT_THAT(fault_of("1,0,0\n1,0,0\n"), HasSubstr("does not come after"));
  EXPECT_THAT(fault_of("x,y,time\n"), HasSubstr("line 1"));
  for (const char* empty : {"", "\n", "time,x,y\n"}) EXPECT_THAT(fault_of(empty), HasSubstr("holds no line"));
  EXPECT_EQ(fault_of(std::string("0,0.5,0.5\n1,\x01\n")).find('\x01'), std::string::npos);
}

TEST(FocusTrack, EveryTruncatedLengthIsATrackOrAFault) {
  const std::string text = "time,x,y\n0,0.5,0.5\n0.25,0.75,0.125\n";
  for (std::size_t n = 0; n <= text.size(); ++n) {
    const auto exact = std::make_unique<char[]>(n);
    std::copy_n(text.data(), n, exact.get());
    try {
      EXPECT_GE(FocusTrack::parse({exact.get(), n}, "eye.csv").size(), 1u);
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), "eye.csv");
    }
  }
}

TEST(FocusTrack, SizesAreLimited) {
  std::string text;
  for (std::size_t n = 0; n <= FocusTrack::kMaxLines; ++n) text += std::to_string(n) + ",0,0\n";
  EXPECT_THROW(FocusTrack::parse(text, "eye.csv"), LimitError);
  text.resize(text.rfind('\n', text.size() - 2) + 1);
  EXPECT_EQ(FocusTrack::parse(text, "eye.csv").size(), FocusTrack::kMaxLines);
  const test::TemporaryFolder folder;
  EXPECT_THROW(FocusTrack::read(folder / "none.csv"), InputError);
  test::write_text(folder / "large.csv", std::string(FocusTrack::kMaxBytes + 1, ' '));
  EXPECT_THROW(FocusTrack::read(folder / "large.csv"), LimitError);
}

}  // namespace
}  // namespace tessera::gpu::focus_track_test
