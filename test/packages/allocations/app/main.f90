!> Splitting runs by every loop, plain and compensated; the argument is the number of steps.
program main
    use frb, only: wp, body_drift, drift_by_name, heavy_top, integrate, rigid_body, splitting_scheme
    use frb_still_bodies, only: even_torques, onlooker
    implicit none
    integer, parameter :: n = 50
    character(8), parameter :: names(2) = [character(8) :: 'srkn11', 'srkn14']
    type(even_torques) :: scene
    type(heavy_top) :: top
    type(onlooker) :: record
    type(rigid_body) :: body(n)
    class(body_drift), allocatable :: drift
    real(wp) :: m(3, n), q(4, n)
    character(8) :: argument
    integer :: steps, i, k
    logical :: compensated
    call get_command_argument(1, argument)
    read (argument, *) steps
    do i = 1, n
        body(i) = rigid_body([1.0_wp, 1.5_wp, 1.6_wp + 0.01_wp*i])
        m(:, i) = [sin(1.0_wp*i), cos(2.0_wp*i), sin(3.0_wp*i)]
        q(:, i) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    end do
    call drift_by_name('quat_step', drift)
    do k = 1, 2
        do i = 1, 2
            compensated = i == 2
            associate (scheme => splitting_scheme(names(k)))
                call integrate(body(1), scheme, top, 0.01_wp, steps, m(:, 1), q(:, 1), &
                               compensated=compensated)
                call integrate(body(1), scheme, scene, 0.01_wp, steps, m, q, compensated=compensated)
                call integrate(body, scheme, scene, 0.01_wp, steps, m, q, record, compensated=compensated)
                call integrate(body, scheme, scene, 0.01_wp, steps, m, q, drift=drift, &
                               compensated=compensated)
            end associate
        end do
    end do
end program main
