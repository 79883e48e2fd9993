#include "memory/ledger.h"
#include "tests/support/tests.h"

namespace tessera::memory::ledger_test {
namespace {

TEST(Ledger, TotalsAreTheSumOfEveryUnitAndPurpose) {
  Ledger a, b;
  a.read(Unit::kFrontend, Purpose::kPatchData, 64);
  a.write(Unit::kResolve, Purpose::kFrameBuffer, 128);
  b.read(Unit::kTilecore, Purpose::kTileQueue, 32);
  a += b;
  EXPECT_EQ(a.total().read_bytes, 96u);
  EXPECT_EQ(a.total().written_bytes, 128u);
  EXPECT_EQ(a.traffic(Unit::kTilecore, Purpose::kTileQueue).read_bytes, 32u);
}

TEST(Ledger, ATransferMovesEveryBurstItTouchesAndNoOther) {
  EXPECT_EQ(burst_bytes(0, 0, 64), 0u);
  EXPECT_EQ(burst_bytes(0, 1, 64), 64u);
  EXPECT_EQ(burst_bytes(0, 64, 64), 64u);
  EXPECT_EQ(burst_bytes(63, 2, 64), 128u);
  EXPECT_EQ(burst_bytes(64, 64, 64), 64u);
  EXPECT_EQ(burst_bytes(100, 200, 32), 7 * 32u);  // bursts 3..9
}

}  // namespace
}  // namespace tessera::memory::ledger_test
