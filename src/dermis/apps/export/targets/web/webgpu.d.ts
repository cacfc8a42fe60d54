// WebGPU's flags, which TypeScript's own library does not declare yet.
declare const GPUBufferUsage: Record<"COPY_SRC" | "COPY_DST" | "MAP_READ" | "UNIFORM", number>;
declare const GPUTextureUsage: Record<"COPY_DST" | "RENDER_ATTACHMENT", number>;
declare const GPUShaderStage: Record<"VERTEX" | "FRAGMENT" | "COMPUTE", number>;
declare const GPUMapMode: Record<"READ", number>;
