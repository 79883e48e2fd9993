#include "replay/view/view_server.h"

#include <charconv>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "replay/report/report.h"
#include "scene/framing.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

constexpr const char* kJson = "application/json; charset=utf-8";
// Beats between comments that keep a connection alive.
constexpr unsigned kBeatsOfComment = 50;

HttpReply json_reply(unsigned status, const json& value) { return http_reply(status, json_text(value) + "\n", kJson); }

json views_of(const ViewResult& result) {
  json view = result.image.view;
  view["image"] = fmt::format("image/{}.png", result.image.number);
  return json::array({std::move(view)});
}

}  // namespace

ViewServer::ViewServer(ViewStart start, std::uint64_t max_bytes, int port, Told told)
    : session_(std::move(start), max_bytes),
      told_(std::move(told)),
      keys_(session_.space().keys()),
      server_(port, "events", [this](const HttpRequest& request) { return answer(request); }) {
  session_.run([this](const std::shared_ptr<const ViewResult>& result) { tell(result); });
}

ViewServer::~ViewServer() {
  session_.stop();
  server_.close();
}

void ViewServer::beat() {
  say("state", session_.state(), said_);
  say("without", session_.left_out(), said_without_);
  const std::lock_guard lock(mutex_);
  if (++beats_ % kBeatsOfComment == 0) server_.send("", "");
}

void ViewServer::say(const char* event, const json& now, json& said) {
  {
    const std::lock_guard lock(mutex_);
    if (now == said) return;
    said = now;
  }
  server_.send(event, json_text(now));
}

HttpReply ViewServer::answer(const HttpRequest& request) {
  if (request.method == "POST") {
    if (request.path == "set" || request.path == "try") return change(request, request.path == "set");
    if (request.path == "without") return measure(request);
    if (request.path == "cancel") {
      session_.cancel_measuring();
      return json_reply(200, json::object());
    }
    return http_reply(404, "not found\n");
  }
  if (request.path.empty()) return page();
  if (request.path.starts_with("image/")) return image(request.path.substr(6));
  return http_reply(404, "not found\n");
}

json ViewServer::result_json(const ViewResult& result) const {
  return {{"revision", result.revision}, {"rendered", result.rendered}, {"stale", result.stale},
          {"seconds", result.seconds},   {"frame", result.frame},       {"changes", result.changes},
          {"command", result.command},   {"summary", result.summary},   {"image", result.image.number}};
}

HttpReply ViewServer::page() const {
  const std::shared_ptr<const ViewResult> result = session_.result();
  if (!result) return http_reply(503, "the first frame is being rendered\n");
  const scene::Capture& capture = *session_.space().start().capture;
  const json& settings = result->stats.at("settings");
  const json data = {
      {"kind", "view"},
      {"title", result->stats.at("capture").at("file").get<std::string>() + ": view"},
      {"subtitle", fmt::format("{}x{}, machine '{}'", settings.at("width").get<int>(), settings.at("height").get<int>(),
                               result->stats.at("gpu").at("preset").get<std::string>())},
      {"stats", result->stats},
      {"views", views_of(*result)},
      {"left_out", 0},
      {"view",
       {{"keys", keys_},
        {"frames", {capture.settings.first_frame, scene::frames_to_see(capture)}},
        {"result", result_json(*result)},
        {"history", session_.history()},
        {"state", session_.state()},
        {"without", session_.left_out()}}}};
  const std::string nonce = random_token();
  HttpReply reply = http_reply(200, page_text(data, nonce), "text/html; charset=utf-8");
  // Plots compile their expressions (unsafe-eval).
  reply.policy = fmt::format(
      "default-src 'none'; script-src 'nonce-{}' 'unsafe-eval'; style-src 'unsafe-inline'; img-src 'self' data:; "
      "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
      nonce);
  return reply;
}

HttpReply ViewServer::change(const HttpRequest& request, bool keep) {
  try {
    const std::uint64_t revision = session_.request(parse_unique_json(request.body, "the request", 2), keep);
    return json_reply(200, {{"revision", revision}});
  } catch (const Error& error) {
    return json_reply(400, {{"error", error.what()}});
  }
}

HttpReply ViewServer::measure(const HttpRequest& request) {
  try {
    session_.measure_without(parse_unique_json(request.body, "the request", 2));
    return json_reply(200, json::object());
  } catch (const Error& error) {
    return json_reply(400, {{"error", error.what()}});
  }
}

HttpReply ViewServer::image(const std::string& name) const {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error == std::errc() && std::string_view(end) == ".png") {
    const std::lock_guard lock(mutex_);
    for (const ViewImage& image : images_)
      if (image.number == number) return {200, "image/png", image.png, "", true};
  }
  return http_reply(404, "not found\n");
}

void ViewServer::tell(const std::shared_ptr<const ViewResult>& result) {
  {
    const std::lock_guard lock(mutex_);
    if (images_.empty() || images_.back().number != result->image.number) images_.push_back(result->image);
    if (images_.size() > kImages) images_.pop_front();
  }
  server_.send("result", json_text({{"result", result_json(*result)},
                                    {"history", session_.history()},
                                    {"stats", result->stats},
                                    {"views", views_of(*result)}}));
  beat();
  if (told_ && result->kept) told_(*result);
}

}  // namespace tessera::replay
