!> Tops in a heat bath: BAOAB, with kicks of torque and bath around the exact free rotation. Free bodies keep
!> the canonical distribution at any step, because the rotation keeps it and the bath keeps it:
!> <m_k^2/(I_k kT)> = 1 within the error of a million samples. Under the torque of V = w u3 the momenta have a
!> bias of order h^2. The bias of the attitudes, against the exact <u3> = 1/x - coth x with x = w/kT, is much
!> smaller.
module frb_bath
    use, intrinsic :: iso_fortran_env, only: int64
    use frb, only: wp
    implicit none
    private

    public :: gaussians

contains

    !> Normal random numbers, the same on every machine: Park and Miller's generator, Box and Muller's pairs.
    subroutine gaussians(seed, x)
        integer(int64), intent(inout) :: seed
        real(wp), contiguous, intent(out) :: x(:, :)
        real(wp), parameter :: two_pi = 2*acos(-1.0_wp), largest = 2147483647.0_wp
        real(wp) :: r, angle
        integer :: i, j
        logical :: second

        second = .false.
        r = 0.0_wp
        angle = 0.0_wp
        do j = 1, size(x, 2)
            do i = 1, size(x, 1)
                if (.not. second) then
                    seed = mod(48271_int64*seed, 2147483647_int64)
                    r = sqrt(-2*log(seed/largest))
                    seed = mod(48271_int64*seed, 2147483647_int64)
                    angle = two_pi*(seed/largest)
                end if
                x(i, j) = r*merge(sin(angle), cos(angle), second)
                second = .not. second
            end do
        end do
    end subroutine gaussians

end module frb_bath

program scene8_langevin
    use, intrinsic :: iso_fortran_env, only: int64
    use frb, only: wp, rigid_body, free_flow, heavy_top, langevin_kick
    use frb_bath, only: gaussians
    implicit none
    integer, parameter :: bodies = 1000, samples = 1000     ! samples of each body
    real(wp), parameter :: moments(3) = [0.6_wp, 0.8_wp, 1.0_wp], kt = 0.5_wp, friction = 2.0_wp
    integer(int64) :: seed
    integer :: i

    seed = 20240229_int64
    print '(a)', 'free bodies      step   <m_k^2/(I_k kT)>            standard errors off 1'
    do i = 1, 3
        call bath(0.0_wp, 0.25_wp*2**i)
    end do
    print '(a)', 'heavy tops       step   <m_k^2/(I_k kT)>            <u3> off the exact one, its error'
    do i = 1, 3
        call bath(2.0_wp, 0.8_wp/2**(i - 1))
    end do

contains

    !> Steps of size h of many bodies; averages over the time of each body, their mean and its standard error.
    subroutine bath(weight, h)
        real(wp), intent(in) :: weight, h
        type(rigid_body) :: body
        real(wp) :: m(3, bodies), q(4, bodies), noise(3, bodies), sums(4, bodies), mean(4), error(4), x
        integer :: step, k
        integer, parameter :: settling = 100

        body = rigid_body(moments)
        call gaussians(seed, q)
        do k = 1, bodies
            q(:, k) = q(:, k)/norm2(q(:, k))
        end do
        m = 0.0_wp
        sums = 0.0_wp
        do step = 1, settling + samples
            call kick(weight, 0.5_wp*h, q, m)
            call free_flow(body, 0.5_wp*h, m, q)
            call gaussians(seed, noise)
            call langevin_kick(body, friction, kt, h, noise, m)
            call free_flow(body, 0.5_wp*h, m, q)
            call kick(weight, 0.5_wp*h, q, m)
            if (step <= settling) cycle
            do k = 1, 3
                sums(k, :) = sums(k, :) + m(k, :)**2/(moments(k)*kt)
            end do
            sums(4, :) = sums(4, :) + 1 - 2*(q(2, :)**2 + q(3, :)**2)
        end do
        sums = sums/samples
        mean = sum(sums, 2)/bodies
        error = sqrt(sum((sums - spread(mean, 2, bodies))**2, 2)/bodies/(bodies - 1))
        if (weight > 0.0_wp) then
            x = weight/kt
            print '(f21.2,3f9.4,es18.1,es11.1)', h, mean(1:3), mean(4) - (1/x - 1/tanh(x)), error(4)
        else
            print '(f21.2,3f9.4,3f8.1)', h, mean(1:3), (mean(1:3) - 1)/error(1:3)
        end if
    end subroutine bath

    !> The torque of V = weight u3: u = Q^T e3, tau = weight u x e3.
    subroutine kick(weight, h, q, m)
        real(wp), intent(in) :: weight, h, q(:, :)
        real(wp), intent(inout) :: m(:, :)
        real(wp) :: u(3)
        integer :: k

        do k = 1, size(q, 2)
            u = [2*(q(2, k)*q(4, k) - q(1, k)*q(3, k)), 2*(q(3, k)*q(4, k) + q(1, k)*q(2, k)), 0.0_wp]
            m(1, k) = m(1, k) + h*weight*u(2)
            m(2, k) = m(2, k) - h*weight*u(1)
        end do
    end subroutine kick

end program scene8_langevin

! Output:
!   free bodies      step   <m_k^2/(I_k kT)>            standard errors off 1
!                    0.50   0.9976   0.9989   1.0006    -1.4    -0.7     0.4
!                    1.00   1.0037   1.0016   1.0005     2.6     1.1     0.4
!                    2.00   1.0002   1.0003   1.0017     0.2     0.2     1.2
!   heavy tops       step   <m_k^2/(I_k kT)>            <u3> off the exact one, its error
!                    0.80   0.6023   0.6979   0.9976           4.1E-03    3.6E-04
!                    0.40   0.8999   0.9282   1.0001           5.5E-04    5.1E-04
!                    0.20   0.9747   0.9828   1.0017           1.5E-04    6.8E-04
