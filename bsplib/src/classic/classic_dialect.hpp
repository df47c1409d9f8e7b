// The functions whose types depend on the dialect. Included once a dialect, after bsp.h.
using Dialect = bsp2::bsplib::classic::Api<bsp_pid_t, bsp_nprocs_t, bsp_size_t>;

extern "C" {

void bsp_begin(bsp_nprocs_t maxprocs) { bsp2::bsplib::classic::begin(static_cast<long long>(maxprocs)); }

bsp_nprocs_t bsp_nprocs(void) { return static_cast<bsp_nprocs_t>(bsp2::bsplib::classic::nprocs()); }

bsp_pid_t bsp_pid(void) { return static_cast<bsp_pid_t>(bsp2::bsplib::classic::engine("bsp_pid").pid()); }

void bsp_push_reg(const void* address, bsp_size_t nbytes) { Dialect::push_reg(address, nbytes); }

void bsp_put(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset, bsp_size_t nbytes) {
  Dialect::put(pid, src, dst, offset, nbytes);
}

void bsp_hpput(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset, bsp_size_t nbytes) {
  Dialect::hpput(pid, src, dst, offset, nbytes);
}

void bsp_get(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes) {
  Dialect::get("bsp_get", pid, src, offset, dst, nbytes, false);
}

void bsp_hpget(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes) {
  Dialect::get("bsp_hpget", pid, src, offset, dst, nbytes, true);
}

void bsp_direct_get(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes) {
  Dialect::direct_get(pid, src, offset, dst, nbytes);
}

void bsp_set_tagsize(bsp_size_t* tag_nbytes) { Dialect::set_tagsize(tag_nbytes); }

void bsp_send(bsp_pid_t pid, const void* tag, const void* payload, bsp_size_t payload_nbytes) {
  Dialect::send(pid, tag, payload, payload_nbytes);
}

void bsp_qsize(bsp_nprocs_t* nmessages, bsp_size_t* accum_nbytes) { Dialect::qsize(nmessages, accum_nbytes); }

void bsp_get_tag(bsp_size_t* status, void* tag) { Dialect::get_tag(status, tag); }

void bsp_move(void* payload, bsp_size_t reception_nbytes) { Dialect::move(payload, reception_nbytes); }

bsp_size_t bsp_hpmove(void** tag, void** payload) { return Dialect::hpmove(tag, payload); }

}  // extern "C"
