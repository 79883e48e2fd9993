#include "timing/events/texture_path.h"

#include <algorithm>
#include <numeric>

namespace tessera::timing {

TexturePath::TexturePath(const hardware::Machine& gpu, std::uint32_t core, EventQueue& events, MemoryPath& memory)
    : core_(core),
      events_(events),
      memory_(memory),
      latency_(gpu.queues.texture_latency_clk),
      cache_(gpu.caches.texture_bytes, hardware::Caches::kTextureWays, gpu.line_bytes()),
      requests_(static_cast<std::size_t>(gpu.queues.texture_requests)),
      free_requests_(requests_.size()) {
  std::iota(free_requests_.rbegin(), free_requests_.rend(), 0u);
}

void TexturePath::submit(const std::uint32_t* lines, std::uint32_t count, double cycles, EventKind kind,
                         std::uint32_t what) {
  queue_.push_back({lines, count, 0, cycles, kind, what, 0});
  if (queue_.size() == 1) start(events_.now());
}

void TexturePath::start(double now) {
  Job& job = queue_.front();
  job.group = memory_.open_group(job.kind, core_, job.what);
  started_ = now;
  look_up(now);
}

void TexturePath::look_up(double now) {
  Job& job = queue_.front();
  blocked_ = false;
  const std::uint32_t first = job.next;
  std::uint32_t next = first;  // a copy, as the code below may change job
  for (; next < job.count; ++next) {
    const std::uint32_t line = job.lines[next];
    if (const std::uint32_t* found = cache_.use(line)) {
      if (*found == RequestCache::kThere) continue;
      memory_.add_wait(job.group);
      requests_[*found].groups.push_back(job.group);
      continue;
    }
    if (free_requests_.empty()) {
      blocked_ = true;
      break;
    }
    ++misses_;
    const std::uint32_t request = free_requests_.back();
    free_requests_.pop_back();
    requests_[request].line = line;
    requests_[request].groups.assign(1, job.group);
    memory_.add_wait(job.group);
    cache_.take(line, request);
    memory_.read_line(line, core_, request, now);
  }
  requested_ += next - first;
  job.next = next;
  if (blocked_) return;
  // The unit takes at least a clock for each line.
  const double cycles = std::max(job.cycles, static_cast<double>(job.count));
  busy_ += cycles;
  events_.push(std::max(now, started_ + cycles), hardware::Stage::kTexture, EventKind::kTextureFree, core_);
}

void TexturePath::fill(std::uint32_t request, double now) {
  Request& done = requests_[request];
  cache_.fill(done.line, request);
  for (const std::uint32_t group : done.groups) memory_.settle(group, now, Bound::kLatency);
  done.groups.clear();
  free_requests_.push_back(request);
  if (blocked_) look_up(now);
}

void TexturePath::free_again(double now) {
  const Job done = queue_.front();
  queue_.pop_front();
  memory_.close_group(done.group, now + latency_, Bound::kLatency);
  if (!queue_.empty()) start(now);
}

}  // namespace tessera::timing
