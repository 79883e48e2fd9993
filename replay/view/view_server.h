#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <nlohmann/json.hpp>

#include "replay/view/loopback_server.h"
#include "replay/view/view_session.h"

namespace tessera::replay {

// A view's page, and the requests that it makes:
//
//   GET  .../               the page: report.html's page and its panel (report/page/view.js)
//   GET  .../events         server-sent events: "result" with the newest result, "state" with ViewSession::state(),
//                           "without" with ViewSession::left_out()
//   GET  .../image/N.png    an image of the newest kImages renderings
//   POST .../set, .../try   {KEY: value or null}; `try` leaves no trace in the history. {"revision": N}, or 400 and
//                           {"error": TEXT}
//   POST .../without        {} or {"node": TEXT, "material": TEXT}: measures the frame without each drawable, or without
//                           that one. {}, or 400 and {"error": TEXT}
//   POST .../cancel         {}: ends that measurement. {}
class ViewServer {
 public:
  using Told = std::function<void(const ViewResult&)>;

  // Starts to listen and to render. `told`, unless empty, receives every kept result, on the session's thread.
  ViewServer(ViewStart start, std::uint64_t max_bytes, int port, Told told = {});
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  std::string url() const { return server_.url(); }
  int port() const { return server_.port(); }
  ViewSession& session() { return session_; }
  // Call it a few times a second: sends the progress of the current frame, and keeps connections alive.
  void beat();

 private:
  static constexpr std::size_t kImages = 8;

  HttpReply answer(const HttpRequest& request);
  HttpReply page() const;
  HttpReply measure(const HttpRequest& request);
  // Sends an event when `now` differs from `said`.
  void say(const char* event, const nlohmann::json& now, nlohmann::json& said);
  HttpReply change(const HttpRequest& request, bool keep);
  HttpReply image(const std::string& name) const;
  void tell(const std::shared_ptr<const ViewResult>& result);
  nlohmann::json result_json(const ViewResult& result) const;

  ViewSession session_;
  Told told_;
  nlohmann::json keys_;
  LoopbackServer server_;
  mutable std::mutex mutex_;  // guards the following members
  std::deque<ViewImage> images_;
  nlohmann::json said_, said_without_ = nlohmann::json::object();
  unsigned beats_ = 0;
};

}  // namespace tessera::replay
