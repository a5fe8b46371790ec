//! Names of mechanisms, as in reports and files.

use std::fmt;

macro_rules! ids {
    ($($id:ident $name:literal $what:literal)*) => {
        /// What a simulation may have left out.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Id {
            $(#[doc = $what] $id,)*
        }

        impl Id {
            /// All of them: the physics first, then what the measurement itself does, in the order of the contract.
            pub const ALL: &[Id] = &[$(Id::$id),*];

            /// Name in reports and files.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Id::$id => $name,)*
                }
            }
        }
    };
}

ids! {
    SealDrag "seal-drag" "Constant friction of seals, wipers and cage."
    ViscousDrag "viscous-drag" "Drag that grows with speed and not with load: seals, churned grease."
    ViscosityTemperature "viscosity-temperature" "The oil thins with temperature."
    SelfHeating "self-heating" "Friction warms the oil."
    HysteresisAndSlip "hysteresis-and-slip" "Elastic hysteresis and differential slip in the contacts."
    HydrodynamicRolling "hydrodynamic-rolling" "Rolling resistance of the oil in the contact's inlet."
    TractionSaturation "traction-saturation" "Shear stress of the film that stops growing in proportion to speed."
    Stribeck "stribeck" "Friction that falls with speed, for laws without such a term."
    Starvation "starvation" "Film that thins while the contacts run and recovers in a rest."
    RunIn "run-in" "Drag that wears off over the first metres."
    ExternalLoad "external-load" "A known load on the block."
    MomentLoad "moment-load" "A tilting moment on the block."
    RailStraightness "rail-straightness" "Slow waves of the rail that change the preload."
    RailJoint "rail-joint" "A step between two rails."
    PreloadLoss "preload-loss" "Preload that falls with travel."
    ThermalPreload "thermal-preload" "Preload that follows the temperature difference of block and rail."
    DirectionAsymmetry "direction-asymmetry" "Friction that differs between the directions."
    GravityTilt "gravity-tilt" "Weight along a rail that is not level."
    Inertia "inertia" "Mass that is accelerated."
    CableChain "cable-chain" "Force of a cable chain, hose or bellows."
    DriveRipple "drive-ripple" "Force that repeats with the angle of screw or motor."
    Contamination "contamination" "Dirt on the rail or a particle on a ball."
    BallPass "ball-pass" "Balls that enter and leave the loaded zone."
    Presliding "presliding" "Friction that needs some travel after a reversal to build up."
    FrictionalLag "frictional-lag" "Friction that follows a change of speed late."
    BreakawayDwell "breakaway-dwell" "Friction that has grown in a rest."
    StructuralResonance "structural-resonance" "Elasticity between drive and carriage."
    ForceOffset "force-offset" "Zero of the force sensor."
    ForceDrift "force-drift" "Zero of the force sensor that moves."
    ForceGain "force-gain" "Scale of the force sensor."
    LoadCrosstalk "load-crosstalk" "Load of the block seen by the force sensor."
    ForceLowpass "force-lowpass" "Low-pass filter of the force channel."
    TimeMisalignment "time-misalignment" "Force and position on different clocks."
    ForceQuantisation "force-quantisation" "Coarse steps of the force channel."
    ForceSaturation "force-saturation" "End of the force channel's range."
    CouplingBacklash "coupling-backlash" "Play between drive and carriage."
    SpeedNoise "speed-noise" "Noise of the speed that the law is evaluated at."
    EncoderCyclicError "encoder-cyclic-error" "Error of the encoder that repeats with its signal period."
}

impl Id {
    /// The mechanism of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Id::ALL.iter().copied().find(|id| id.name() == name)
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
