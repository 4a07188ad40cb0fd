#pragma once

#include "common/guards.hpp"
#include "common/workspace_pool.hpp"
#include "vantage/plugin.hpp"

namespace vantage::matching {

/// A target's answer about a scan at a pose: use(workspace). No other call uses the workspace.
/// Errors: those of check_scan and of `use`; `internal` for an exception.
template <class Answer, class Workspace, class Use>
[[nodiscard]] Result<Answer> answer_with(WorkspacePool<Workspace>& workspaces, PointsView scan,
                                         const Pose& T_map_scan, const Use& use) noexcept {
  return guarded([&]() -> Result<Answer> {
    VANTAGE_CHECK(check_scan(scan, T_map_scan));
    const typename WorkspacePool<Workspace>::Lease workspace(workspaces);
    return use(*workspace);
  });
}

}  // namespace vantage::matching
