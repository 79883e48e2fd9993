"""An emulator of a tile-based deferred GPU. It takes scenes and gives images, counters, traffic, cycles and energy.

    import tessera
    device = tessera.Device(tessera.Scene("captures/eggs.glb"), tessera.Gpu("small", tile__width=32), width=640, height=360)
    frame = device.render(14)
    frame.display()              # NumPy array, as are frame.image() and the values of frame.tile_maps
    frame.counters["dram.read_bytes"]
"""

from tessera._tessera import (
    Device,
    Error,
    Frame,
    Gpu,
    InputError,
    LimitError,
    Scene,
    Settings,
    SystemError,
    UsageError,
    WriteError,
    __version__,
    counter_descriptions,
    gpu_keys,
    settings_keys,
    simd_target,
)
