#pragma once

#include <string>
#include <vector>

namespace vantage::test {

/// A scan of a tiny scans.csv.
struct TinyScan {
  std::string stamp, tracking = "tracked", error_m = "0.01", T_align_ms = "5";
};

/// The columns that comparing needs, in another order than localize writes them, and one more.
inline std::string tiny_csv(const std::vector<TinyScan>& scans) {
  std::string csv =
      "reason,stamp,tracking,switched,blocked,N_point,T_align_ms,stall_ms,fitness,NVTL,coverage,"
      "LCP,"
      "error_m,error_deg,distance_m,held_bytes\n";
  for (const TinyScan& s : scans) {
    const bool lost = s.tracking == "lost";
    csv += "\"a \"\"b\"\", c\"," + s.stamp + "," + s.tracking + ",0,0,100," + s.T_align_ms + ",0," +
           (lost ? ",,,," : "1,2,0.5,0.01,") + s.error_m + ",0.1," + s.stamp + ",1000\n";
  }
  return csv;
}

}  // namespace vantage::test
