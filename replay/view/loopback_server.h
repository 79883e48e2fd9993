#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>

struct MHD_Daemon;

namespace tessera::replay {

struct HttpRequest {
  std::string method;  // "GET" or "POST"
  std::string path;    // below the token: "" is the page
  std::string body;    // of POST
};

struct HttpReply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body;
  std::string policy;       // Content-Security-Policy; "": nothing is allowed
  bool unchanging = false;  // a browser may keep it
};

// 128 random bits of the system as 32 hexadecimal digits. Throws SystemError.
std::string random_token();

HttpReply http_reply(unsigned status, std::string text, std::string type = "text/plain; charset=utf-8");

// A page of one program for browsers of the same machine: HTTP/1.1 by libmicrohttpd, on a thread of its own, which also
// calls the handler.
//
// Invariants (cited by the tests):
//   LS1  It listens on 127.0.0.1 alone.
//   LS2  Another Host than 127.0.0.1:PORT or localhost:PORT is refused (421) whatever the path: a name of another site
//        that leads here shows nothing (DNS rebinding). So is another Origin, where one is sent (403).
//   LS3  Everything is below /TOKEN/, 128 random bits in hexadecimal digits, compared in constant time. Anything else
//        is 404, and so are paths below it that the handler does not know. No path is a path of the file system, and
//        none is decoded.
//   LS4  A body of more than kMaxBody bytes is not kept (413, or the connection ends); nor is a head of more than
//        kMaxConnection. POST takes application/json alone (415).
//   LS5  A slow reader of events gets the newest text of each name; nothing queues up.
//   LS6  close() ends within moments whatever clients do.
class LoopbackServer {
 public:
  using Handler = std::function<HttpReply(const HttpRequest&)>;

  static constexpr std::size_t kMaxBody = 64 << 10;
  static constexpr std::size_t kMaxConnection = 64 << 10;  // bytes of memory
  static constexpr unsigned kMaxConnections = 64;
  static constexpr unsigned kIdleSeconds = 30;

  // `port` 0: any free port. `events`: the path of the stream of events. Throws UsageError where the port is taken or
  // needs privileges, SystemError where no server can be started. Exceptions of the handler become status 500.
  LoopbackServer(int port, std::string events, Handler handler);
  ~LoopbackServer();
  LoopbackServer(const LoopbackServer&) = delete;
  LoopbackServer& operator=(const LoopbackServer&) = delete;

  int port() const { return port_; }
  const std::string& token() const { return token_; }
  // "http://127.0.0.1:PORT/TOKEN/"
  std::string url() const;

  // Sends an event of this name (one line, as JSON text) to all listeners; a later listener gets it first. An empty
  // name is a comment that keeps connections alive.
  void send(const std::string& name, std::string_view text);

  // Stops answering. No thread may call send() meanwhile or later.
  void close();

 private:
  struct Exchange;
  struct Stream;
  struct Callbacks;
  struct Event {
    std::uint64_t sequence = 0;
    std::shared_ptr<const std::string> text;
  };

  bool is_page_host(std::string_view host) const;
  HttpReply answer(const HttpRequest& request) const;
  // The path below the token; null for another token.
  const char* below_token(std::string_view path) const;

  std::string events_path_, token_;
  Handler handler_;
  int port_ = 0;
  MHD_Daemon* daemon_ = nullptr;
  std::mutex mutex_;  // guards the following members
  std::map<std::string, Event> events_;
  std::set<Stream*> streams_;
  std::uint64_t sequence_ = 0;
  bool closing_ = false;
};

}  // namespace tessera::replay
