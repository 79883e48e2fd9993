#include "replay/view/loopback_server.h"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::replay {
namespace {

bool equal_in_constant_time(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char differs = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    differs =
        static_cast<unsigned char>(differs | (static_cast<unsigned char>(a[k]) ^ static_cast<unsigned char>(b[k])));
  return differs == 0;
}

// A socket that listens on 127.0.0.1 and no other address, and its port.
std::pair<int, int> listen_on_loopback(int port) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener < 0) throw SystemError(fmt::format("no socket: {}", std::strerror(errno)));
  // Allows the port of connections that ended a moment ago; a port with another listener stays taken.
  const int yes = 1;
  setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t size = sizeof address;
  if (bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || listen(listener, 16) != 0 ||
      getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int reason = errno;
    ::close(listener);
    throw UsageError(fmt::format("--port {}: {}; 0 takes any that is free", port, std::strerror(reason)));
  }
  return {listener, ntohs(address.sin_port)};
}

// The one header of this name; nothing where there are none or several.
std::optional<std::string> only_header(MHD_Connection* connection, const char* name, bool& several) {
  struct Found {
    const char* name;
    std::vector<std::string> values;
  } found{name, {}};
  MHD_get_connection_values(
      connection, MHD_HEADER_KIND,
      [](void* to, MHD_ValueKind, const char* key, const char* value) {
        auto& f = *static_cast<Found*>(to);
        if (strcasecmp(key, f.name) == 0) f.values.emplace_back(value == nullptr ? "" : value);
        return MHD_YES;
      },
      &found);
  several = found.values.size() > 1;
  if (found.values.size() != 1) return std::nullopt;
  return std::move(found.values.front());
}

MHD_Result queue(MHD_Connection* connection, unsigned status, MHD_Response* response, const std::string& type,
                 const std::string& policy, bool unchanging) {
  const std::string allowed = policy.empty() ? "default-src 'none'; frame-ancestors 'none'" : policy;
  for (const auto& [name, value] : std::initializer_list<std::pair<const char*, const char*>>{
           {"Content-Type", type.c_str()},
           {"Content-Security-Policy", allowed.c_str()},
           {"Cache-Control", unchanging ? "private, max-age=86400, immutable" : "no-store"},
           {"Cross-Origin-Resource-Policy", "same-origin"},
           {"Cross-Origin-Opener-Policy", "same-origin"},
           {"Referrer-Policy", "no-referrer"},
           {"X-Content-Type-Options", "nosniff"},
           {"X-Frame-Options", "DENY"}})
    MHD_add_response_header(response, name, value);
  const MHD_Result queued = MHD_queue_response(connection, status, response);
  MHD_destroy_response(response);
  return queued;
}

// The body lives as long as the response.
using HeldBody = std::shared_ptr<const std::string>;

ssize_t read_body(void* held, std::uint64_t at, char* buffer, std::size_t most) {
  const std::string& body = **static_cast<HeldBody*>(held);
  if (at >= body.size()) return MHD_CONTENT_READER_END_OF_STREAM;
  const std::size_t count = std::min<std::size_t>(most, body.size() - static_cast<std::size_t>(at));
  std::copy_n(body.data() + at, count, buffer);
  return static_cast<ssize_t>(count);
}

MHD_Result send_reply(MHD_Connection* connection, const HttpReply& reply) {
  const HeldBody body = reply.body ? reply.body : std::make_shared<const std::string>();
  MHD_Response* const response = MHD_create_response_from_callback(
      body->size(), 32 << 10, read_body, new HeldBody(body), [](void* held) { delete static_cast<HeldBody*>(held); });
  return response == nullptr ? MHD_NO
                             : queue(connection, reply.status, response, reply.type, reply.policy, reply.unchanging);
}

}  // namespace

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw SystemError(fmt::format("no random token: {}", std::strerror(errno)));
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

HttpReply http_reply(unsigned status, std::string text, std::string type) {
  return {status, std::move(type), std::make_shared<const std::string>(std::move(text)), "", false};
}

// A request on its way in.
struct LoopbackServer::Exchange {
  HttpRequest request;
  bool events = false;
};

// A running response of events: the text being sent, and the bytes sent so far. Call with the server's mutex held.
struct LoopbackServer::Stream {
  LoopbackServer& server;
  MHD_Connection* connection;
  std::shared_ptr<const std::string> text{};
  std::size_t at = 0;
  std::uint64_t sent = 0;  // sequence of `text`
  bool suspended = false;

  bool next() {
    const Event* oldest = nullptr;
    for (const auto& [name, event] : server.events_)
      if (event.sequence > sent && (oldest == nullptr || event.sequence < oldest->sequence)) oldest = &event;
    if (oldest == nullptr) return false;
    text = oldest->text, sent = oldest->sequence, at = 0;
    return true;
  }
};

// Callbacks of libmicrohttpd, on its thread.
struct LoopbackServer::Callbacks {
  static ssize_t read_events(void* of, std::uint64_t, char* buffer, std::size_t most) {
    Stream& stream = *static_cast<Stream*>(of);
    const std::lock_guard lock(stream.server.mutex_);
    if (stream.server.closing_) return MHD_CONTENT_READER_END_OF_STREAM;
    if ((!stream.text || stream.at == stream.text->size()) && !stream.next()) {
      stream.suspended = true;
      MHD_suspend_connection(stream.connection);
      return 0;
    }
    const std::size_t count = std::min(most, stream.text->size() - stream.at);
    std::copy_n(stream.text->data() + stream.at, count, buffer);
    stream.at += count;
    return static_cast<ssize_t>(count);
  }

  static void end_events(void* of) {
    const std::unique_ptr<Stream> stream(static_cast<Stream*>(of));
    const std::lock_guard lock(stream->server.mutex_);
    stream->server.streams_.erase(stream.get());
  }

  static MHD_Result begin_events(LoopbackServer& server, MHD_Connection* connection) {
    auto stream = std::make_unique<Stream>(Stream{server, connection});
    MHD_Response* const response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, 32 << 10, read_events, stream.get(), end_events);
    if (response == nullptr) return MHD_NO;
    {
      const std::lock_guard lock(server.mutex_);
      server.streams_.insert(stream.get());
    }
    static_cast<void>(stream.release());  // end_events() deletes it
    return queue(connection, MHD_HTTP_OK, response, "text/event-stream; charset=utf-8", "", false);
  }

  // Refuses a request before its body arrives; null if there is no reason to.
  static std::optional<HttpReply> refusal(const LoopbackServer& server, MHD_Connection* connection,
                                          const HttpRequest& request, bool known) {
    bool several = false;
    const std::optional<std::string> host = only_header(connection, "Host", several);
    if (!host || !server.is_page_host(*host)) return http_reply(MHD_HTTP_MISDIRECTED_REQUEST, "not this host\n");
    const std::optional<std::string> origin = only_header(connection, "Origin", several);
    if (several || (origin && (!origin->starts_with("http://") || !server.is_page_host(origin->substr(7)))))
      return http_reply(MHD_HTTP_FORBIDDEN, "not from this origin\n");
    if (!known) return http_reply(MHD_HTTP_NOT_FOUND, "not found\n");
    if (request.method == "GET" || request.method == "HEAD") return std::nullopt;
    if (request.method != "POST") return http_reply(MHD_HTTP_METHOD_NOT_ALLOWED, "GET or POST\n");
    const std::optional<std::string> type = only_header(connection, "Content-Type", several);
    if (!type || type->substr(0, type->find(';')) != "application/json")
      return http_reply(MHD_HTTP_UNSUPPORTED_MEDIA_TYPE, "a body of application/json\n");
    const std::optional<std::string> length = only_header(connection, "Content-Length", several);
    if (length && (length->size() > 6 || std::strtoul(length->c_str(), nullptr, 10) > kMaxBody))
      return http_reply(MHD_HTTP_CONTENT_TOO_LARGE, fmt::format("a body of at most {} bytes\n", kMaxBody));
    return std::nullopt;
  }

  static MHD_Result on_request(void* of, MHD_Connection* connection, const char* url, const char* method, const char*,
                               const char* data, std::size_t* size, void** state) {
    auto& server = *static_cast<LoopbackServer*>(of);
    auto* exchange = static_cast<Exchange*>(*state);
    if (exchange == nullptr) {
      *state = exchange = new Exchange;
      const char* const path = server.below_token(url);
      exchange->request = {method, path == nullptr ? "" : path, ""};
      exchange->events = path != nullptr && server.events_path_ == path;
      const std::optional<HttpReply> refused = refusal(server, connection, exchange->request, path != nullptr);
      return refused ? send_reply(connection, *refused) : MHD_YES;
    }
    if (*size > 0) {
      if (exchange->request.body.size() + *size > kMaxBody) return MHD_NO;
      exchange->request.body.append(data, *size);
      *size = 0;
      return MHD_YES;
    }
    if (exchange->request.method == "HEAD") exchange->request.method = "GET";
    if (exchange->events) {
      if (exchange->request.method == "GET") return begin_events(server, connection);
      return send_reply(connection, http_reply(MHD_HTTP_METHOD_NOT_ALLOWED, "GET\n"));
    }
    return send_reply(connection, server.answer(exchange->request));
  }

  static void on_completed(void*, MHD_Connection*, void** state, MHD_RequestTerminationCode) {
    delete static_cast<Exchange*>(*state);
    *state = nullptr;
  }

  // Paths are compared as they came.
  static std::size_t keep_escapes(void*, MHD_Connection*, char* text) { return std::strlen(text); }
};

LoopbackServer::LoopbackServer(int port, std::string events, Handler handler)
    : events_path_(std::move(events)), token_(random_token()), handler_(std::move(handler)) {
  const auto [listener, taken] = listen_on_loopback(port);
  port_ = taken;
  daemon_ =
      MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_AUTO | MHD_ALLOW_SUSPEND_RESUME, 0, nullptr, nullptr,
                       Callbacks::on_request, this, MHD_OPTION_LISTEN_SOCKET, listener, MHD_OPTION_NOTIFY_COMPLETED,
                       Callbacks::on_completed, nullptr, MHD_OPTION_UNESCAPE_CALLBACK, Callbacks::keep_escapes, nullptr,
                       MHD_OPTION_CONNECTION_MEMORY_LIMIT, kMaxConnection, MHD_OPTION_CONNECTION_LIMIT, kMaxConnections,
                       MHD_OPTION_CONNECTION_TIMEOUT, kIdleSeconds, MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_END);
  if (daemon_ == nullptr) {
    ::close(listener);
    throw SystemError("libmicrohttpd starts no server");
  }
}

LoopbackServer::~LoopbackServer() { close(); }

std::string LoopbackServer::url() const { return fmt::format("http://127.0.0.1:{}/{}/", port_, token_); }

bool LoopbackServer::is_page_host(std::string_view host) const {
  return host == fmt::format("127.0.0.1:{}", port_) || host == fmt::format("localhost:{}", port_);
}

const char* LoopbackServer::below_token(std::string_view path) const {
  const std::size_t end = token_.size() + 1;
  if (path.size() <= end || path[0] != '/' || path[end] != '/') return nullptr;
  return equal_in_constant_time(path.substr(1, token_.size()), token_) ? path.data() + end + 1 : nullptr;
}

HttpReply LoopbackServer::answer(const HttpRequest& request) const {
  try {
    return handler_(request);
  } catch (const std::exception& error) {
    return http_reply(MHD_HTTP_INTERNAL_SERVER_ERROR, std::string(error.what()) + "\n");
  }
}

void LoopbackServer::send(const std::string& name, std::string_view text) {
  auto message =
      std::make_shared<const std::string>(name.empty() ? ":\n\n" : fmt::format("event: {}\ndata: {}\n\n", name, text));
  std::vector<MHD_Connection*> waiting;
  {
    const std::lock_guard lock(mutex_);
    if (closing_) return;
    events_[name] = {++sequence_, std::move(message)};
    for (Stream* stream : streams_)
      if (std::exchange(stream->suspended, false)) waiting.push_back(stream->connection);
  }
  // A connection that is suspended goes nowhere before this.
  for (MHD_Connection* connection : waiting) MHD_resume_connection(connection);
}

void LoopbackServer::close() {
  if (daemon_ == nullptr) return;
  std::vector<MHD_Connection*> waiting;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;  // no stream waits from here on
    for (Stream* stream : streams_)
      if (std::exchange(stream->suspended, false)) waiting.push_back(stream->connection);
  }
  for (MHD_Connection* connection : waiting) MHD_resume_connection(connection);
  MHD_stop_daemon(std::exchange(daemon_, nullptr));
}

}  // namespace tessera::replay
