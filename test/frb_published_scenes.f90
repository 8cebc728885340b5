!> Scenes of published motions: the gravity gradient along a Kepler orbit, and a pulse of torque in time.
module frb_gradient_scene
    use frb_frames, only: quat_rotate_back
    use frb_kinds, only: wp
    use frb_status, only: status_ok
    use frb_torque, only: body_scene
    implicit none
    private

    public :: tumbler, new_orbit

    include '../examples/tumbler_model.inc'

end module frb_gradient_scene

module frb_published_scenes
    use frb_gradient_scene, only: tumbler, new_orbit
    use frb_kinds, only: wp
    use frb_status, only: status_ok
    use frb_torque, only: body_scene
    implicit none
    private

    public :: tumbler, new_orbit, pulse

    !> Torque sin^2(t)/4 about axis 3.
    type, extends(body_scene) :: pulse
    contains
        procedure :: torque => pulse_torque
    end type pulse

contains

    subroutine pulse_torque(self, q, t, tau, stat)
        class(pulse), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        associate (unused_self => self, unused_q => q)
        end associate
        tau = [0.0_wp, 0.0_wp, 0.25_wp*sin(t)**2]
        stat = status_ok
    end subroutine pulse_torque

end module frb_published_scenes
